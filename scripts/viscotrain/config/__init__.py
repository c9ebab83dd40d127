"""The config of a study: what may be written, what it means, what is wrong with it."""
