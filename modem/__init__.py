"""The modem of a platform: what its nodes say to others goes out in frames, what frames bring is heard by its nodes."""
