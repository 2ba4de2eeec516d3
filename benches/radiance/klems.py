"""Sides of a measured sheet against Radiance: XML files of Klems' patches that favour one azimuth, by phylux and by rtrace.

    pip install pyradiance
    python benches/radiance/klems.py target/release/phylux

A pane lies level, its outside up. Files let light out towards one azimuth only, or in from one only; both programs must find
it on the same side. Without pyradiance it says so and ends well.
"""

import json
import math
import pathlib
import subprocess
import sys
import tempfile

try:
    import pyradiance
except ImportError:
    sys.exit(print("skipped: no pyradiance here"))

TOOLS = pathlib.Path(pyradiance.__file__).parent / "bin"
LIBRARY = {"RAYPATH": ".:" + str(pathlib.Path(pyradiance.__file__).parent / "lib")}
RINGS = [(5, 1), (15, 8), (25, 16), (35, 20), (45, 24), (55, 24), (65, 24), (75, 16), (90, 12)]
RING, THETA = 4, 40  # the ring of patches that is lit, and its angle to the normal, degrees
AZIMUTHS = range(0, 360, 45)  # of the places that are asked, from x towards y


def patches():
    """Ring and azimuth of each."""
    return [(ring, 360 * cell / cells) for ring, (_, cells) in enumerate(RINGS) for cell in range(cells)]


def xml(passes):
    """A file of f = 0.3 where `passes` says so of the patches of incidence and exit."""
    def block(direction, value):
        rows = "\n".join(", ".join(str(value(i, o)) for i in patches()) for o in patches())
        kind = "BTDF" if direction.startswith("T") else "BRDF"
        return (f'<WavelengthData><Wavelength unit="Integral">Visible</Wavelength><WavelengthDataBlock>'
                f"<WavelengthDataDirection>{direction}</WavelengthDataDirection>"
                f"<ColumnAngleBasis>LBNL/Klems Full</ColumnAngleBasis><RowAngleBasis>LBNL/Klems Full</RowAngleBasis>"
                f"<ScatteringDataType>{kind}</ScatteringDataType><ScatteringData>\n{rows}\n</ScatteringData>"
                f"</WavelengthDataBlock></WavelengthData>\n")

    names = ["Transmission Front", "Transmission Back", "Reflection Front", "Reflection Back"]
    values = [lambda i, o: 0.3 if passes(i, o) else 0] + 3 * [lambda i, o: 0]
    lower = [0] + [upper for upper, _ in RINGS]
    basis = "".join(f"<AngleBasisBlock><Theta>{(low + upper) / 2 if low else 0}</Theta><nPhis>{cells}</nPhis><ThetaBounds>"
                    f"<LowerTheta>{low}</LowerTheta><UpperTheta>{upper}</UpperTheta></ThetaBounds></AngleBasisBlock>"
                    for low, (upper, cells) in zip(lower, RINGS))
    return ('<?xml version="1.0" encoding="UTF-8"?>\n<WindowElement><WindowElementType>System</WindowElementType><Optical><Layer>'
            '<Material><Name>sheet</Name><Manufacturer>none</Manufacturer><Thickness unit="Meter">0</Thickness></Material>'
            "<DataDefinition><IncidentDataStructure>Columns</IncidentDataStructure><AngleBasis>"
            f"<AngleBasisName>LBNL/Klems Full</AngleBasisName>{basis}</AngleBasis></DataDefinition>"
            + "".join(map(block, names, values)) + "</Layer></Optical></WindowElement>\n")


def toward(azimuth, up):
    theta, phi = math.radians(THETA), math.radians(azimuth)
    return (math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), up * math.cos(theta))


def by_radiance(folder, source, eyes):
    """Radiance below the pane, whose inside is its front there; +y is up for the file."""
    def run(name, *arguments, **more):
        done = subprocess.run([TOOLS / name, *arguments], cwd=folder, env=LIBRARY, check=True, capture_output=True, **more)
        return done.stdout

    sun = " ".join(map(str, source))
    (folder / "pane.rad").write_text(
        f"void light lit 0 0 3 1000 1000 1000\nlit source sun 0 0 4 {sun} 0.5\n"
        "void BSDF sheet 6 0 sheet.xml 0 1 0 . 0 0\n"
        "sheet polygon pane 0 0 12  -0.1 -0.1 0  -0.1 0.1 0  0.1 0.1 0  0.1 -0.1 0\n")
    (folder / "pane.oct").write_bytes(run("oconv", "pane.rad"))
    rays = "".join(" ".join(str(x) for x in (*eye, *(-x for x in eye))) + "\n" for eye in eyes)
    lines = run("rtrace", "-h", "-ab", "0", "-dc", "1", "-dt", "0", "-ds", "0", "-dj", "0", "pane.oct", input=rays.encode())
    return [float(line.split()[0]) for line in lines.decode().splitlines() if line.strip()]


def by_phylux(program, folder, source, eyes):
    """Irradiance of discs below the pane, whose outside is its front here; u of its texture is +x."""
    (folder / "pane.obj").write_text("v -0.1 -0.1 0\nv 0.1 -0.1 0\nv 0.1 0.1 0\nv -0.1 0.1 0\n"
                                     "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n")
    spot = {"type": "spot", "position": [3 * x for x in source], "direction": [-x for x in source],
            "half_angle_deg": 1, "power": 1}
    discs = [{"name": str(i), "disc": {"center": [2 * x for x in eye], "normal": [-x for x in eye], "radius": 0.1}}
             for i, eye in enumerate(eyes)]
    (folder / "scene.json").write_text(json.dumps({
        "materials": {"sheet": {"type": "table", "file": "sheet.xml"}},
        "objects": [{"obj": "pane.obj", "material": "sheet"}], "lights": [spot], "captors": discs}))
    command = [program, "run", "scene.json", "--photons", "100000", "--k", "0", "--quiet"]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    results = json.loads((folder / "results.json").read_text())
    return [captor["front"]["irradiance"][0] for captor in results["captors"]]


def brightest(values):
    """The only azimuth that is lit."""
    lit = [azimuth for azimuth, value in zip(AZIMUTHS, values) if value > 0.05 * max(values)]
    return lit[0] if len(lit) == 1 else lit


def main():
    program = str(pathlib.Path(sys.argv[1]).resolve())
    differ = False
    straight, down = (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)
    for azimuth in (0, 90, 180, 270):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            (folder / "sheet.xml").write_text(xml(lambda _, leaving: leaving == (RING, azimuth)))
            eyes = [toward(place, -1) for place in AZIMUTHS]
            out = [brightest(by_phylux(program, folder, straight, eyes)), brightest(by_radiance(folder, straight, eyes))]
            (folder / "sheet.xml").write_text(xml(lambda coming, _: coming == (RING, azimuth)))
            suns = [toward(place, 1) for place in AZIMUTHS]
            ours = [by_phylux(program, folder, sun, [down])[0] for sun in suns]
            theirs = [by_radiance(folder, sun, [down])[0] for sun in suns]
            come = [brightest(ours), brightest(theirs)]
        print(f"azimuth {azimuth} of the file: light leaves towards {out[0]}, in Radiance {out[1]};"
              f" comes from {come[0]}, in Radiance {come[1]}")
        differ |= out[0] != out[1] or come[0] != come[1]
    if differ:
        sys.exit("the sides differ")


main()
