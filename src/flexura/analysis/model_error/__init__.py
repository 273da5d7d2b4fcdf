"""The second margin: how far the part may be from the model, and what that rests on."""
