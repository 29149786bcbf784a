"""Paired tests, intervals, effect sizes, correlations, trial planning.

Everything here works on numpy arrays or on a results table (`trials.parquet` as Arrow), never on a trial.
"""

from __future__ import annotations

from clearway.statistics.acceptance import Decision, Judged, Verdict, judge
from clearway.statistics.acceptance_plan import Outlook, outlooks, repetitions
from clearway.statistics.acceptance_trials import refuse_strange_groups
from clearway.statistics.columns import GROUP, SYSTEM, any_estimate, batch_names
from clearway.statistics.comparison import Comparison, compare
from clearway.statistics.configurations import ConfigurationComparison, Repetitions, compare_configurations
from clearway.statistics.correlation import (
    FEWEST,
    PAPER_A,
    POOLED,
    TOO_FEW,
    Correlation,
    Correlations,
    Reduced,
    correlation_table,
    correlations,
    correlations_by_robot,
    pearson,
    reduced_set,
    spearman,
    strength,
)
from clearway.statistics.criteria import Criteria, Criterion, load_criteria
from clearway.statistics.describe import (
    FEWEST_RESAMPLED,
    bootstrap_interval,
    describe,
    mean_interval,
    normality,
    success_rates,
)
from clearway.statistics.multiple import asterisks, holm
from clearway.statistics.proportions import (
    Interval,
    PairedSuccess,
    RateDifference,
    mcnemar,
    paired_success,
    rate_difference,
    success_interval,
    wilson_interval,
)
from clearway.statistics.samples import reliability_shown, samples_needed
from clearway.statistics.side_by_side import compare_all
from clearway.statistics.signed_rank import SignedRank, signed_rank
from clearway.statistics.speeds import ANALYSES, wilcoxon_between_speeds

__all__ = [
    "ANALYSES",
    "FEWEST",
    "FEWEST_RESAMPLED",
    "GROUP",
    "PAPER_A",
    "POOLED",
    "SYSTEM",
    "TOO_FEW",
    "Comparison",
    "ConfigurationComparison",
    "Correlation",
    "Correlations",
    "Criteria",
    "Criterion",
    "Decision",
    "Interval",
    "Judged",
    "Outlook",
    "PairedSuccess",
    "RateDifference",
    "Reduced",
    "Repetitions",
    "SignedRank",
    "Verdict",
    "any_estimate",
    "asterisks",
    "batch_names",
    "bootstrap_interval",
    "compare",
    "compare_all",
    "compare_configurations",
    "correlation_table",
    "correlations",
    "correlations_by_robot",
    "describe",
    "holm",
    "judge",
    "load_criteria",
    "mcnemar",
    "mean_interval",
    "normality",
    "outlooks",
    "paired_success",
    "pearson",
    "rate_difference",
    "reduced_set",
    "refuse_strange_groups",
    "reliability_shown",
    "repetitions",
    "samples_needed",
    "signed_rank",
    "spearman",
    "strength",
    "success_interval",
    "success_rates",
    "wilcoxon_between_speeds",
    "wilson_interval",
]
