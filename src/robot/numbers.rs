//! Numbers on the bus of what has names in the code. They never change their meaning.
