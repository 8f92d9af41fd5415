"""Pictures for people: what the camera saw, what the tracker made of it, pictures of their own, control points."""
