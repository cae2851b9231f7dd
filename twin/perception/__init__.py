"""What images show: tags; pure, without messages. OpenCV (extra `vision`) is imported when it is needed."""
