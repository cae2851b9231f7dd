"""What a world looks like: materials, textures, decals; only the model that is drawn has them."""
