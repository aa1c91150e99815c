"""Identification of a DNLRX: thresholds searched for outside, all that is linear solved for inside (Amthor et al. 2008)."""
