"""What light does a canopy of pale, green and dark leaves take up? From chlorophyll to absorbed photons.

    python leaf_spectra.py

PROSPECT-D makes the spectra of the leaves; three layers of leaves hang under a white LED panel.
"""

import numpy as np

import phylux as px

CHLOROPHYLL = {"pale": 12, "green": 35, "dark": 70}  # ug/cm2
EDGES = np.arange(400, 751, 25)


def contents(chlorophyll):
    return {"n": 1.5, "chlorophyll": chlorophyll, "carotenoids": chlorophyll / 4, "water": 0.012, "dry_matter": 0.004}


def canopy(chlorophyll):
    """Three layers of 150 leaves of 10 x 6 cm on 1 m2 of soil, endless to all sides, under a panel of 400 umol/s."""
    s = px.Scene("canopy", quantity="umol/s", bands={str(nm): (nm, nm + 25) for nm in EDGES[:-1]}, periodic={"x": [0, 1], "y": [0, 1]})
    s.material("leaf", type="leaf", prospect=contents(chlorophyll))
    s.material("soil", type="lambert", reflectance=0.12)
    random = np.random.default_rng(1)
    for layer in range(3):
        turn, lean = random.uniform(0, 2 * np.pi, 150), random.uniform(-0.6, 0.6, 150)
        along = np.column_stack([np.cos(turn) * np.cos(lean), np.sin(turn) * np.cos(lean), np.sin(lean)])
        across = np.column_stack([-np.sin(turn), np.cos(turn), 0 * turn])
        at = np.column_stack([random.uniform(0.06, 0.94, (150, 2)), 0.2 + 0.15 * layer + random.uniform(0, 0.05, 150)])
        a, b, c, d = (at + u * along + v * across for u, v in ((-0.05, 0), (0, -0.03), (0.05, 0), (0, 0.03)))
        blades = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
        s.add(f"layer {layer + 1}", {"leaves": blades}, material="leaf", captor=True)
    s.add("soil", [[[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 0, 0], [1, 1, 0], [0, 1, 0]]], material="soil", captor=True)
    s.light("panel", type="area", vertices=[[0.01, 0.01, 1.5], [0.01, 0.99, 1.5], [0.99, 0.99, 1.5], [0.99, 0.01, 1.5]],
            power={"spectrum": "LED-B3", "total": 400, "quantity": "umol/s"})
    return s


def main(photons=1e6):
    """Returns the absorbed share of the light by kind of leaf; draws the spectra into leaf_spectra.png."""
    import matplotlib.pyplot as plt

    shares = {}
    with px.plots.style(3.5):
        fig, ax = plt.subplots(layout="constrained")
        for (name, chlorophyll), colour in zip(CHLOROPHYLL.items(), ("C4", "C2", "C0")):
            r = canopy(chlorophyll).run(photons=photons, k=0, seed=1)
            leaves = np.array([i.startswith("layer") for i in r.ids])
            shares[name] = np.array(r.absorbed)[leaves].sum(axis=0) / np.array(r.energy["emitted"])
            ax.stairs(shares[name], EDGES, baseline=None, color=colour, linewidth=1.2)
            # names stand where lines are apart: above the first, and below the others
            above = name == "dark"
            ax.annotate(f"{name}, {chlorophyll}", (563, 0.695 if above else shares[name][5]), (0, 0 if above else -3),
                        textcoords="offset points", ha="center", va="bottom" if above else "top", color=colour)
        ax.set_title("leaves and their chlorophyll, µg/cm²")
        ax.set(xlabel="wavelength, nm", ylabel="share of light that leaves absorb", xlim=(400, 750), ylim=(0, 0.8))
        fig.savefig("leaf_spectra.png")
    return shares


if __name__ == "__main__":
    for name, share in main().items():
        print(f"{name}: {share[:12].mean():.2f} of 400 to 700 nm, {share[4:8].mean():.2f} of green light")
