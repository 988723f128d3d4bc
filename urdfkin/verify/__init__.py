"""How exact a result must be, and how exact it was: bounds, comparison, sampling, certificates, reports."""
