"""Errors of the workbench that tests have to find."""

from studies.mutations import of

STATISTICS = "relume/workbench/test_statistics.py"

estimates = of("relume/workbench/estimates.py", STATISTICS)
statistics = of("relume/workbench/statistics.py", STATISTICS)
measures = of("relume/workbench/measures.py", "relume/workbench/test_measures.py")

WORKBENCH = [
    estimates("variance of the runs divided by n", "/ ((n - 1) * n)", "/ (n * n)"),
    statistics(
        "standard errors 2 % too small",
        "t = np.divide(d.mean, np.sqrt(d.variance)",
        "t = np.divide(1.02 * d.mean, np.sqrt(d.variance)",
    ),
    statistics(
        "score 2 % too high",
        "return np.sign(t) * z",
        "return 1.02 * np.sign(t) * z",
    ),
    statistics(
        "threshold for twice as many tests",
        "np.expm1(np.log1p(-rate) / tests)",
        "np.expm1(np.log1p(-rate) / (2 * tests))",
    ),
    statistics(
        "intervals 2 % too narrow",
        "(1 - confidence) / 2) * np.sqrt(variance)",
        "(1 - confidence) / 2) * 0.98 * np.sqrt(variance)",
    ),
    statistics(
        "Welch's degrees of freedom 2 % too many",
        "dof = variance**2 / (",
        "dof = 1.02 * variance**2 / (",
    ),
    estimates(
        "noise of a lone picture 2 % too low",
        "noise = np.maximum(sums / count - explained, 0)",
        "noise = 0.96 * np.maximum(sums / count - explained, 0)",
        f"{STATISTICS}::test_noise_of_a_lone_picture",
    ),
    statistics(
        "ratio's interval without the reference's noise",
        "r**2 * b.variance",
        "0 * b.variance",
        f"{STATISTICS}::test_ratio_and_its_interval",
    ),
    measures(
        "relMSE 2 % too high",
        "return float((square * w).mean())",
        "return float((1.02 * square * w).mean())",
    ),
    measures(
        "debiasing takes off 2 % too much",
        "(square - reference.pixels.variance)",
        "(square - 1.02 * reference.pixels.variance)",
    ),
    measures(
        "efficiency 2 % too high", "return 1 / (mse * seconds)", "return 1.02 / (mse * seconds)"
    ),
]
