"""How scripts run: messages, files, provenance, progress."""
