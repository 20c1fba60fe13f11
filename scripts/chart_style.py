"""Colours, dashes, matplotlib settings and bars that the charts of these scripts and records share."""

# Okabe & Ito (2008): told apart with any kind of colour vision; line styles tell them apart in print.
COLOURS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000"]
STYLES = ["-", (0, (6, 2)), (0, (2, 1.5)), (0, (7, 2, 1.5, 2))]
STYLE = {
    "font.size": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.7,
    "axes.axisbelow": True,
    "axes.edgecolor": "#555555",
    "xtick.color": "#333333",
    "ytick.color": "#333333",
    "legend.frameon": False,
    "lines.linewidth": 1.8,
    "svg.fonttype": "none",
}

ENERGIES = [("friction", "friction", COLOURS[0]), ("contacts that crush", "crushing_contacts", COLOURS[1]),
            ("cells that break", None, COLOURS[3]), ("elastic", "elastic", COLOURS[2]),
            ("stabilisation", "stabilisation", "#999999")]


def energy_bars(axes, ends, names):
    """Where the work went, a bar a run: `ends` have the columns energy_* of each run's last row, `names` stand beside them."""
    left = [0.0] * len(ends)
    for label, name, colour in ENERGIES:
        def share(end):
            part = end[f"energy_{name}"] if name else end["energy_damage"] - end["energy_crushing_contacts"]
            return 100 * part / end["energy_external"]
        shares = [share(end) for end in ends]
        axes.barh(range(len(ends)), shares, left=left, color=colour, label=label, height=0.6)
        left = [from_here + share for from_here, share in zip(left, shares)]
    axes.set_yticks(range(len(ends)), names)
    axes.invert_yaxis()
    axes.set_xlabel("share of the work to the end [%]")
    axes.legend(loc="upper center", bbox_to_anchor=(0.45, -0.2), ncol=3)
