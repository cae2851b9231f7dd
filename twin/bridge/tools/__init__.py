"""What the topic commands are made of: statistics, relays, types that are not known here."""
