"""Two mechanisms laid on each other, and how far they can be apart: what `same` and `dh --compare` share."""
