"""The tables of `efficiency`: figures as Markdown."""

import numpy as np

CHOSEN = "chosen"


def chosen_efficiency(figures):
    """Efficiency of what the plan chooses, over `path`: the mean error over its seeds counts."""
    methods = figures["methods"]
    mean = np.mean([1 / methods[name]["efficiency"] for name in figures["choice"][CHOSEN]])
    return 1 / mean / methods["path"]["efficiency"]


def better_efficiency(figures):
    """Efficiency of the better one of the two that are chosen from, over `path`.

    Where only one of them finds all light, it is the better one.
    """
    methods = figures["methods"]
    names = ["surfacepath", "bdpt"] if "gains" in figures["choice"] else figures["choice"][CHOSEN]
    best = max(methods[name]["efficiency"] for name in names)
    return best / methods["path"]["efficiency"]


def overview(results):
    """Efficiency over `path` of every method in every scene, with 95 % intervals."""
    names = [name for name in next(iter(results.values()))["methods"] if name != "path"]
    heads = ["scene", *(f"`{name}`" for name in names), "what the plan chooses"]
    lines = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    for title, figures in results.items():
        methods = figures["methods"]
        cells = []
        for name in names:
            gain = methods[name]["efficiency"] / methods["path"]["efficiency"]
            low, high = methods[name]["interval"]
            cells.append(f"{gain:.3g} ({low:.2g} to {high:.2g})")
        cells.append(f"{chosen_efficiency(figures):.3g}")
        lines.append(f"| {title} | {' | '.join(cells)} |")
    return "\n".join(lines)


def details(results):
    """Errors, times, median pixels and tails."""
    heads = ["scene", "method", "samples", "CPU-s", "relMSE", "median pixel over `path`"]
    heads += ["error in 0.5 % of the pixels", "energy"]
    lines = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    for title, figures in results.items():
        methods = figures["methods"]
        for name, row in methods.items():
            median = row["median"] / methods["path"]["median"]
            lines.append(
                f"| {title} | `{name}` | {row['spp']} | {row['cpu']:.2f} | {row['relMSE']:.3g} "
                f"| {median:.2g} | {row['tail']:.0%} | {row['energy']:.3f} |"
            )
    return "\n".join(lines)


def choices(results):
    """What was chosen by ten seeds, and how that compares to the better candidate."""
    heads = ["scene", "`bdpt` over `surfacepath`, by efficiency", "by ten pilots", "chosen"]
    heads += ["efficiency of the choice over the better one's", "CPU-s of a pilot"]
    lines = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    for title, figures in results.items():
        methods, choice = figures["methods"], figures["choice"]
        gain = methods["bdpt"]["efficiency"] / methods["surfacepath"]["efficiency"]
        counts = {name: choice[CHOSEN].count(name) for name in dict.fromkeys(choice[CHOSEN])}
        said = ", ".join(f"`{name}` {count} times" for name, count in counts.items())
        pilots, cost = f"none: {choice.get('reason')}", ""
        if "gains" in choice:
            pilots = f"{min(choice['gains']):.2g} to {max(choice['gains']):.2g}"
            cost = f"{choice['seconds']:.2g}"
        share = chosen_efficiency(figures) / better_efficiency(figures)
        lines.append(f"| {title} | {gain:.2g} | {pilots} | {said} | {share:.2f} | {cost} |")
    return "\n".join(lines)


def text(results):
    """All tables."""
    mean = np.exp(np.mean([np.log(chosen_efficiency(x)) for x in results.values()]))
    said = f"Geometric mean of the last column, of {len(results)} scenes: {mean:.2g}."
    return "\n\n".join([overview(results), said, choices(results), details(results)]) + "\n"
