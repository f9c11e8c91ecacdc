# In the place of GMP's doc/Makefile.in, which Debian's source has not.
all install check:
