"""Errors of the workbench that tests have to find."""

from studies.mutations import of

STATISTICS = "relume/workbench/test_statistics.py"

estimates = of("relume/workbench/estimates.py", STATISTICS)
statistics = of("relume/workbench/statistics.py", STATISTICS)
measures = of("relume/workbench/measures.py", "relume/workbench/test_measures.py")
tone = of("relume/tone.py", "relume/test_tone.py")
noise = of("relume/noise.py", "relume/test_noise.py")
denoising = of("relume/denoising.py", "relume/test_denoising.py")
live = of("relume/live.py", "relume/test_live.py")

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
    tone("middle grey 2 % brighter", "MIDDLE_GREY = 0.18", "MIDDLE_GREY = 0.1836"),
    tone("exposures 2 % too high", "* 2.0 ** self.stops", "* 1.02 * 2.0 ** self.stops"),
    tone("luminance of green 2 % too low", "[0.2126, 0.7152, 0.0722]", "[0.2126, 0.7009, 0.0722]"),
    tone("toe of the ACES curve 2 % too high", "x + 0.03)", "x + 0.0306)"),
    tone("toe of Hable's curve 2 % too high", "0.20, 0.02, 0.30", "0.20, 0.0204, 0.30"),
    tone("range of AgX 2 % too wide", "(-12.47393, 4.026069)", "(-12.47393, 4.106)"),
    noise("noise judged without its own error", "CONFIDENCE = 2.33", "CONFIDENCE = 0.0"),
    noise(
        "advice of 2 % too many samples",
        "factor = (noise / WISHED) ** 2",
        "factor = 1.02 * (noise / WISHED) ** 2",
    ),
    denoising("guess counts 2 % too little", "(share * guess", "(0.98 * share * guess"),
    denoising("bias without the noise of its estimate", "square - 2 * v", "square - v"),
    live("rate of samples 2 % too high", "taken * self._pixels /", "1.02 * taken * self._pixels /"),
]
