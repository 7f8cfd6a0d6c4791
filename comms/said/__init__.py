"""What nodes say: values on the wire, messages, topics, and who may write and read what."""
