"""Commands about robot files."""
