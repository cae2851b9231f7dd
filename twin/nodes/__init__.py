"""One thin node per capability: parameters, topics, services and actions around one class from below."""
