"""What a bag of a robot tells about its wheels, delays and sensors, and how sure that is."""
