"""Many missions of one scenario, flown by several allocators and by what was usual before, and their figures."""
