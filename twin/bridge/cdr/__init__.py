"""Messages to CDR bytes and back."""
