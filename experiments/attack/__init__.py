"""Attacks on seatruth: fuzzers, hostile files and kills, with one table of what was tried and what gave way."""
