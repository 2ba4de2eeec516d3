"""What would white floors bring? One run says how much the light on the benches depends on each surface.

    python white_floors.py
"""

import numpy as np

import phylux as px

VALUES = (0.1, 0.3, 0.5, 0.7, 0.9)


def room(floor=0.2, walls=0.5):
    """A room of 6 x 4 x 3 m with six lamps over two benches of crop, and floor and walls of these reflectances."""
    s = px.Scene("room", quantity="umol/s", bands={"PAR": (400, 700)}, sensitivity=True)
    for name, reflectance in (("floor", floor), ("walls", walls), ("ceiling", 0.7), ("crop", 0.07)):
        s.material(name, type="lambert", reflectance=reflectance)

    def sheet(name, material, corner, across, along):
        a, b, c = (np.asarray(v, dtype=float) for v in (corner, across, along))
        s.add(name, [[a, a + b, a + b + c], [a, a + b + c, a + c]], material=material)

    sheet("floor", "floor", (0, 0, 0), (6, 0, 0), (0, 4, 0))
    sheet("ceiling", "ceiling", (0, 0, 3), (0, 4, 0), (6, 0, 0))
    for i, (corner, along) in enumerate((((0, 0, 0), (6, 0, 0)), ((6, 0, 0), (0, 4, 0)), ((6, 4, 0), (-6, 0, 0)), ((0, 4, 0), (0, -4, 0)))):
        sheet(f"wall {i}", "walls", corner, (0, 0, 3), along)
    for i, y in enumerate((0.5, 2.3)):
        sheet(f"bench {i}", "crop", (0.5, y, 0.8), (5, 0, 0), (0, 1.2, 0))
        s.captor(f"bench {i}", discs=px.grid(np.linspace(0.8, 5.2, 8), np.linspace(y + 0.2, y + 1.0, 3), 0.85, radius=0.05), group="benches")
    for i, (x, y) in enumerate((x, y) for x in (1, 3, 5) for y in (1.1, 2.9)):
        s.light(f"lamp {i}", type="spot", position=[x, y, 2.6], direction=[0, 0, -1], half_angle_deg=60, power=300)
    return s


def light(result):
    """Returns the mean PPFD on the benches."""
    groups = result.groups
    rows = (groups.group == "benches") & (groups.face == "front") & (groups.quantity == "irradiance")
    return float(groups[rows].value.iloc[0])


def main(photons=3e5):
    """Returns the elasticity of the benches' light by each material, and their mean PPFD by reflectance of floor and walls; draws both."""
    import matplotlib.pyplot as plt

    own = room().run(photons=photons, k=0, seed=1)
    table = own.sensitivity
    table = table[(table.group == "benches") & (table.face == "front") & table.parameter.str.startswith("/materials/")]
    table.index = table.parameter.str.split("/").str[2]
    elasticity = dict(table.elasticity)
    options = {"photons": photons, "k": 0, "seed": 1}
    ppfd = {name: np.array([light(r) for r in px.sweep(room, {name: VALUES}, **options)]) for name in ("floor", "walls")}

    with px.plots.style(3.5):
        fig, (bars, curves) = plt.subplots(2, 1, layout="constrained", height_ratios=(2, 3))
        order = sorted(elasticity, key=lambda name: abs(elasticity[name]))
        bars.barh(order, [10 * elasticity[name] for name in order], color="C0")
        bars.set(xlabel="change by 10 % more reflectance, %", xticks=np.arange(0, 2, 0.5))
        for colour, (name, at) in zip(("C0", "C1"), (("floor", 0.2), ("walls", 0.5)), strict=True):
            curves.plot(VALUES, ppfd[name], "o", color=colour)
            ends = np.array([at - 0.2, at + 0.3])
            curves.plot(ends, light(own) + float(table.derivative[name]) * (ends - at), "-", color=colour)
            curves.annotate(name, (VALUES[-1], ppfd[name][-1]), (6, 0), textcoords="offset points", va="center", color=colour)
        curves.annotate("dots: a run each\nlines: by the one run", (0.03, 0.94), xycoords="axes fraction", va="top")
        curves.set(xlabel="reflectance", ylabel="PPFD, µmol/m²/s", xlim=(0, 1.1))
        fig.savefig("white_floors.png")
    return elasticity, ppfd


if __name__ == "__main__":
    elasticity, ppfd = main()
    for name, value in sorted(elasticity.items(), key=lambda of: -abs(of[1])):
        print(f"10 % more reflectance of the {name}: {10 * value:+.2f} % on the benches")
    for name, found in ppfd.items():
        print(f"{name} from {VALUES[0]} to {VALUES[-1]}: {found[0]:.1f} to {found[-1]:.1f} umol/m2/s")
