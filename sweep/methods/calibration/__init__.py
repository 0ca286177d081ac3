"""Calibration: the parameters of a model that recordings or trials support.

section    `calibrate`, with its keys
rule       data, summaries, prior, and numbers of simulations

distances  distances of summaries, scaled by the prior
proposals  kept simulations, their weights, and the next proposals
targets    the data, and synthetic data sets that check the posterior

strategy   the trials that a launch runs, and the table of simulations
analysis   the posterior of a stored study, with its checks
evidence   how much data speak for each of several models
model_odds the odds of several stored calibrations

report     posterior and odds as reports
figure     the posterior as a figure
method     the entry of calibration, with section and command
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
