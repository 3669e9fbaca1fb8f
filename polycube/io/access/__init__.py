"""Which files are read and written: regular ones, one run at a time, with sound content."""
