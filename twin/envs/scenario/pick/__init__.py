"""`twin/WarehousePick-v0`: dock and grasp, the last metre of the warehouse mission."""
