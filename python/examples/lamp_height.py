"""How high should the lamps hang? PPFD and its evenness over a bench for eleven heights of four LED bars.

    python lamp_height.py
"""

import numpy as np

import phylux as px

HEIGHTS = np.round(np.arange(0.2, 1.21, 0.1), 2)


def bench(height):
    """A bench of 2.4 x 1.2 m with white sides of 0.3 m, below four bars at this height over the crop."""
    s = px.Scene("bench", quantity="umol/s", bands={"PAR": (400, 700)})
    s.material("crop", type="lambert", reflectance=0.08)
    s.material("side", type="lambert", reflectance=0.6)
    s.add("crop", [[[0, 0, 0], [2.4, 0, 0], [2.4, 1.2, 0]], [[0, 0, 0], [2.4, 1.2, 0], [0, 1.2, 0]]], material="crop")
    corner = np.array([[0, 0], [2.4, 0], [2.4, 1.2], [0, 1.2], [0, 0]])
    low, high = (np.column_stack([corner, np.full(5, z)]) for z in (0, 0.3))
    sides = [t for i in range(4) for t in ([low[i], high[i], low[i + 1]], [high[i], high[i + 1], low[i + 1]])]
    s.add("sides", sides, material="side")
    for i, y in enumerate((0.15, 0.45, 0.75, 1.05)):
        s.light(f"bar {i}", type="area", power=220,
                vertices=[[0.1, y - 0.02, height], [0.1, y + 0.02, height], [2.3, y + 0.02, height], [2.3, y - 0.02, height]])
    s.captor("crop", discs=px.grid(np.linspace(0.1, 2.3, 12), np.linspace(0.1, 1.1, 6), 0.01, radius=0.04))
    return s


def main(photons=1e6):
    """Returns mean PPFD and the least over the mean, by height; draws the mean and the least PPFD into lamp_height.png."""
    import matplotlib.pyplot as plt

    found = px.sweep(bench, {"height": HEIGHTS}, photons=photons, k=0, seed=1, guiding="aim")
    ppfd = np.array([r.irradiance[:, 0, 0] for r in found])
    mean, even = ppfd.mean(axis=1), ppfd.min(axis=1) / ppfd.mean(axis=1)
    with px.plots.style(3.5):
        fig, ax = plt.subplots(layout="constrained")
        least, most = ppfd.min(axis=1), ppfd.max(axis=1)
        ax.fill_between(HEIGHTS, least, most, alpha=0.2, linewidth=0)
        for values, style, name in ((mean, "o-C0", "mean"), (least, "s-C1", "least sensor")):
            ax.plot(HEIGHTS, values, style)
            ax.annotate(name, (HEIGHTS[-1], values[-1]), (6, 0), textcoords="offset points", va="center", color=style[-2:])
        ax.annotate("range of sensors", (HEIGHTS[2], most[2]), (5, 4), textcoords="offset points", color="C0")
        ax.set(xlabel="lamp height, m", ylabel="PPFD, µmol/m²/s", xlim=(0, 1.6), xticks=np.arange(0, 1.3, 0.2), ylim=(0, 350))
        fig.savefig("lamp_height.png")
    return mean, even


if __name__ == "__main__":
    for height, mean, even in zip(HEIGHTS, *main()):
        print(f"{height:.1f} m: {mean:.0f} umol/m2/s, least / mean {even:.2f}")
