"""Any scenario file as a gymnasium environment: an agent does one part, the autonomy stack all the rest."""
