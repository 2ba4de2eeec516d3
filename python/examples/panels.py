"""How much light do solar panels leave to the crop, by their tilt and by the hour?

    python panels.py

Endless rows of panels, 6 m apart and 2.5 m high, over a field at 43.6 degrees north on a clear day of June.
"""

import numpy as np

import phylux as px

HOURS, TILTS = np.arange(5, 20, 1.0), (0, 30, 60)
X = np.linspace(0.25, 5.75, 12)
# where the name of each tilt stands: beside which place, how far aside in points, and on which side
NAMES = {0: (6, (0, -8), "center"), 30: (5, (-6, -4), "right"), 60: (5, (6, 4), "left")}


def field(tilt, hour):
    """The field at an hour of true solar time, with panels that lean to the south by `tilt` degrees."""
    declination, latitude = np.radians([23.4, 43.6])
    turn = np.radians(15 * (hour - 12))
    up = np.sin(latitude) * np.sin(declination) + np.cos(latitude) * np.cos(declination) * np.cos(turn)
    south = np.sin(latitude) * np.cos(declination) * np.cos(turn) - np.cos(latitude) * np.sin(declination)
    west = np.cos(declination) * np.sin(turn)
    sun = {"elevation_deg": float(np.degrees(np.arcsin(up))), "azimuth_deg": float(180 + np.degrees(np.arctan2(west, south)))}
    # a clear sky (Haurwitz 1945), a seventh of whose light is diffuse; 2.05 umol of PAR in a joule
    overall = 1098 * up * np.exp(-0.059 / up)
    s = px.Scene("field", quantity="umol/s", bands={"PAR": (400, 700)}, sun_at=sun, periodic={"x": [0, 2], "y": [0, 6]})
    s.material("panel", type="lambert", reflectance=0.05)
    s.material("soil", type="lambert", reflectance=0.12)
    corner = [[0.01, -1.1, 0], [1.99, -1.1, 0], [1.99, 1.1, 0], [0.01, 1.1, 0]]
    s.add("panel", np.array(corner)[[[0, 1, 2], [0, 2, 3]]], material="panel",
          transform={"rotate_deg": [tilt, 0, 0], "translate": [0, 3, 2.5]})
    s.add("soil", np.array([[0, 0, 0], [2, 0, 0], [2, 6, 0], [0, 6, 0]], float)[[[0, 1, 2], [0, 2, 3]]], material="soil")
    s.light("sun", type="sun", irradiance=2.05 * 6 / 7 * overall / up)
    s.light("sky", type="sky", model="uniform", irradiance=2.05 / 7 * overall)
    s.captor("crop", discs=px.grid([1], X, 0.3, radius=0.25))
    return s, 2.05 * overall


def main(photons=1e6):
    """Returns the share of the open field's daily light that reaches each place, by tilt; draws it into panels.png."""
    import matplotlib.pyplot as plt

    shares = {}
    with px.plots.style(3.5):
        fig, ax = plt.subplots(layout="constrained")
        for tilt in TILTS:
            fields = [field(tilt, hour) for hour in HOURS]
            runs = [s.run(photons=photons, k=0, seed=1) for s, _ in fields]
            found, errors = (np.array([getattr(r, name)[:, 0, 0] for r in runs]) for name in ("irradiance", "irradiance_se"))
            free = sum(overall for _, overall in fields)
            shares[tilt] = found.sum(axis=0) / free
            errors = np.sqrt((errors**2).sum(axis=0))
            light = 0.0036 * found.sum(axis=0)
            line = ax.errorbar(X, light, 0.0036 * errors, fmt="o-")
            # names where the lines are apart
            place, aside, across = NAMES[tilt]
            ax.annotate(f"{tilt}°", (X[place], light[place]), aside, textcoords="offset points", ha=across, va="center",
                        color=line[0].get_color())
        ax.axhline(0.0036 * free, linestyle="--", color="C6")
        ax.annotate("open field", (6, 0.0036 * free), (0, 2), textcoords="offset points", ha="right", va="bottom", color="C6")
        ax.plot([1.9, 4.1], [72, 72], color="0.3", linewidth=3, solid_capstyle="butt")
        ax.annotate("panels", (3, 72), (0, 3), textcoords="offset points", ha="center", va="bottom", color="0.3")
        ax.set(xlabel="across the rows, m", ylabel="DLI, mol/m²/d", xlim=(0, 6), ylim=(0, 80), xticks=range(7))
        fig.savefig("panels.png")
    return shares


if __name__ == "__main__":
    for tilt, share in main().items():
        print(f"{tilt} degrees: {share.mean():.2f} of the open field's light, {share.min():.2f} to {share.max():.2f}")
