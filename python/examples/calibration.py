"""Finds the powers of four lamps from the readings of a sensor, and says how sure they are.

    python calibration.py

The "instrument" is a run of the same room with lamps of other powers, read to 3 %: so the right answer is known.
"""

import numpy as np
import pandas as pd

import phylux as px

TRUE = {"lamp 1": 0.82, "lamp 2": 1.05, "lamp 3": 0.93, "lamp 4": 1.12}


def room():
    """A room of 3 x 2 x 2 m with grey walls, four lamps of 200 umol/s, and 24 places to measure at."""
    s = px.Scene("room", quantity="umol/s", bands={"PAR": (400, 700)})
    s.material("wall", type="lambert", reflectance=0.4)
    corner = np.array([[x, y, z] for x in (0, 3) for y in (0, 2) for z in (0, 2)], float)
    walls = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
    s.add("walls", (corner, [t for a, b, c, d in walls for t in ([a, b, c], [a, c, d])]), material="wall")
    for i, (x, y) in enumerate([(0.75, 0.5), (0.75, 1.5), (2.25, 0.5), (2.25, 1.5)], start=1):
        s.light(f"lamp {i}", type="area", vertices=[[x - 0.2, y - 0.1, 1.9], [x - 0.2, y + 0.1, 1.9], [x + 0.2, y + 0.1, 1.9],
                                                     [x + 0.2, y - 0.1, 1.9]], power=200)
    s.captor("grid", discs=px.grid(np.linspace(0.25, 2.75, 6), np.linspace(0.25, 1.75, 4), 0.5, radius=0.05))
    return s


def main(photons=2e6):
    """Returns the factors on the powers and their standard errors; draws them beside the true ones, and the readings
    against the simulation."""
    import matplotlib.pyplot as plt

    s = room()
    r = s.run(photons=photons, k=0, seed=1, by_light=True)
    # the instrument: the same lamps at other powers, another seed, and an error of 3 % in each reading
    seen = s.run(photons=photons, k=0, seed=2, by_light=True).mix(TRUE)
    readings = seen.irradiance[:, 0, 0] * np.random.default_rng(3).normal(1, 0.03, len(seen.ids))
    readings = pd.DataFrame({"captor": r.ids, "value": readings, "sd": 0.03 * readings})
    found = s.calibrate(readings, result=r, model="lamps")
    factors, errors = ([of[lamp][0] for lamp in TRUE] for of in (found.factors, found.factors_se))

    # what the instrument should read by the simulation, with the powers of the data sheet and with those found
    sheet, fitted = (run.irradiance[:, 0, 0] for run in (r, r.mix(dict(zip(TRUE, factors, strict=True)))))
    with px.plots.style(3.5):
        fig, (left, right) = plt.subplots(1, 2, width_ratios=(4, 5), layout="constrained")
        places = np.arange(len(TRUE))
        left.errorbar(places, factors, 1.98 * np.array(errors), fmt="o", elinewidth=0.8, capsize=2)
        left.plot(places, list(TRUE.values()), "_", markersize=10, markeredgewidth=1.5, color="C1")
        left.annotate("found, 95 %", (places[0], 0.58), color="C0", ha="left", xytext=(-6, 0), textcoords="offset points")
        left.annotate("true", (places[0], 0.53), color="C1", ha="left", xytext=(-6, 0), textcoords="offset points")
        left.set(xlabel="lamp", ylabel="power / data sheet", ylim=(0.5, 1.3), xlim=(-0.5, len(TRUE) - 0.5), xticks=places,
                 xticklabels=[lamp.removeprefix("lamp ") for lamp in TRUE])
        # on the line, the simulation is right
        values = np.concatenate([sheet, fitted, readings.value])
        ends = [10 * np.floor(values.min() / 10), 10 * np.ceil(values.max() / 10)]
        right.plot(ends, ends, color="0.6", linewidth=0.8)
        right.plot(sheet, readings.value, "o", markersize=3, markerfacecolor="none", color="0.45")
        right.plot(fitted, readings.value, "o", markersize=3, color="C0")
        ticks = np.arange(ends[0], ends[1] + 1, 10)
        right.set(xlabel="simulated, µmol/m²/s", ylabel="read, µmol/m²/s", xlim=ends, ylim=ends, xticks=ticks, yticks=ticks)
        for height, name, colour in ((0.17, "found", "C0"), (0.05, "data sheet", "0.45")):
            right.text(0.98, height, name, transform=right.transAxes, ha="right", color=colour)
        fig.savefig("calibration.png")
    return np.array(factors), np.array(errors)


if __name__ == "__main__":
    for lamp, factor, error in zip(TRUE, *main()):
        print(f"{lamp}: {factor:.3f} ± {error:.3f} (true: {TRUE[lamp]})")
