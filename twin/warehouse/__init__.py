"""The capstone's world and mission: arenas, goods, maps, pick and place."""
