"""What nodes say and how it travels: messages, topic table, node protocol, clock and the two buses."""
