"""Point clouds as numpy's structured arrays: files, filters, planes, clusters; pure, without messages.

A cloud has a field for each of its quantities, under PCL's names: x, y, z [m]; intensity, rgb, ring, time.
Its shape is (n,), or (height, width) if it is organised, as a depth camera's is. What was not measured has
NaN for x, y, z. `twin/bridge/point_cloud2.py` makes messages of such arrays, and reads them.
"""
