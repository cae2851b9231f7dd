"""How well `/amcl` localises in the warehouse: tracking, global localisation, kidnapped robots."""
