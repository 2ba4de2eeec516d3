"""Whether guided photons find the same light as photons alone: every value of some scenes, both ways.

    python benches/agree.py target/release/phylux scenes/*.json

Each scene is run by photons alone (seed 1), with what a trial chooses (`--guiding auto`, seed 2) and with importance (`--guiding
full`, seed 3), all with the same number of photons, and by paths (seed 4) where photons alone bring fewer than 1,000 arrivals to a
face; by 16 times as many photons alone in place of paths where these miss light (`unseen`). Compared are irradiance, and what
surfaces absorb, of every captor, face and band: z is the difference over the standard error of both. Printed are the RMS of z,
which is 1 by chance, the largest |z|, and the odds that so many values have one as large by chance. Values that a run itself marks as not to be trusted (`few_paths`) are counted and left out.
A scene whose name ends in .sweep.json or .control.json is none.
"""

import argparse
import json
import math
import pathlib
import subprocess
import tempfile

LIT = 1000


def run(program, scene, folder, options):
    out = folder / "out.json"
    command = [program, "run", scene, "--k", "0", "--quiet", "-o", out, *options]
    subprocess.run([str(word) for word in command], check=True, capture_output=True)
    return json.loads(out.read_text())


def values(result):
    """Mean, error, arrivals and whether that is to be trusted, by captor, what and band."""
    found = {}
    for captor in result["captors"]:
        faces = {face: captor[face] for face in ("front", "back") if captor.get(face)}
        sure = []
        for name, face in faces.items():
            sure.append(not face.get("few_paths"))
            for band, (mean, error) in enumerate(zip(face["irradiance"], face["irradiance_se"])):
                found[captor["id"], name, band] = mean, error or 0, face["photons"], sure[-1]
        arrivals = sum(face["photons"] for face in faces.values())
        for band, (mean, error) in enumerate(zip(captor.get("absorbed") or [], captor.get("absorbed_se") or [])):
            found[captor["id"], "absorbed", band] = mean, error or 0, arrivals, all(sure)
    return found


def better(once, words):
    """What dim faces are compared with: paths or, where these miss light, more photons alone."""
    paths = once("--estimator", "paths", "--photons", words.paths, "--seed", 4, "--threads", 1)
    if max(paths.get("unseen", [0])) < 1e-3:
        return values(paths)
    photons = 16 * float(words.photons)
    return values(once("--guiding", "off", "--photons", photons, "--seed", 5, "--threads", 1))


def compare(guided, plain, dim):
    """Every z, and how many values are left out."""
    zs, left_out = [], 0
    for key, (mean, error, _, trusted) in guided.items():
        reference = plain[key]
        if reference[2] < LIT and dim:
            reference = dim[key]
        both = math.hypot(error, reference[1])
        if not (trusted and reference[3] and error and reference[1]):
            left_out += mean > 0 or reference[0] > 0
        else:
            zs.append((mean - reference[0]) / both)
    return zs, left_out


def main():
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    words.add_argument("program", type=pathlib.Path)
    words.add_argument("scenes", nargs="+", type=pathlib.Path)
    words.add_argument("--photons", default="1e6")
    words.add_argument("--paths", default="1e6")
    words = words.parse_args()
    scenes = [scene for scene in words.scenes if not scene.name.endswith((".sweep.json", ".control.json"))]
    with tempfile.TemporaryDirectory() as folder:
        for scene in scenes:
            once = lambda *options: run(words.program.resolve(), scene.resolve(), pathlib.Path(folder), options)
            photons = lambda way, seed: once("--guiding", way, "--photons", words.photons, "--seed", seed, "--threads", 1)
            plain = values(photons("off", 1))
            faint = any(arrivals < LIT for _, _, arrivals, _ in plain.values())
            dim = better(once, words) if faint else None
            for seed, way in ((2, "auto"), (3, "full")):
                guided = photons(way, seed)
                zs, left_out = compare(values(guided), plain, dim)
                rms = math.sqrt(sum(z * z for z in zs) / len(zs)) if zs else 0
                most = max(map(abs, zs), default=0)
                odds = 1 - (1 - math.erfc(most / math.sqrt(2))) ** len(zs)
                chosen = guided["settings"].get("guiding", "off")
                print(f"{scene.parent.name}/{scene.name:24} {way:4} ({chosen:4}) {len(zs):5} values, {left_out} left out, RMS z {rms:.2f}, "
                      f"largest |z| {most:.2f}, odds {odds:.2g}", flush=True)


if __name__ == "__main__":
    main()
