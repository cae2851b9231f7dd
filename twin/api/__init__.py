"""What `import twin` offers: robots, worlds, simulations, files read back; `twin` itself maps the names."""
