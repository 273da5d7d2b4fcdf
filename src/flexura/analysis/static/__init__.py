"""Linear statics and kinetostatics."""
