"""Solutions in report.json and on the page: modes, static deformation, potential."""

from __future__ import annotations

from html import escape

import numpy as np

from polycube.analysis.recovery import samples
from polycube.pipeline.state import RunState
from polycube.report.numbers.words import beside, cautions, largest, megapascal
from polycube.report.page.markup import (
    Pictures,
    facts,
    figure,
    gradient,
    grid,
    section,
    show,
    table,
)
from polycube.report.pictures.colours import DISPLACEMENT_COLOURS, FIELD_COLOURS
from polycube.report.pictures.fields import exaggeration, first_elastic
from polycube.types import Deformation, Json, Modes, Potential, Solution, Spline


def numbers(spline: Spline, solution: Solution) -> dict[str, dict[str, object]]:
    """Numbers in `report.json` under the name of the analysis: modes, static or poisson."""
    units = {"units": dict(solution.units)}
    if isinstance(solution, Modes):
        found = {
            "omega_squared": solution.eigenvalues.tolist(),
            "frequency_hz": solution.frequency.tolist(),
            "rigid": solution.rigid,
            "mass": solution.mass,
        }
        return {"modes": found | units}
    if isinstance(solution, Deformation):
        return {"static": _static(spline, solution) | units}
    return {"poisson": _poisson(spline, solution) | units}


def _static(spline: Spline, found: Deformation) -> dict[str, object]:
    moved = samples(spline, spline.extraction @ found.displacement)
    peak, other = found.peak, found.singular
    stress = samples(spline, found.von_mises[:, None])[..., 0]
    found_there = _largest(spline, "von_mises", stress)
    if peak is not None:
        found_there = {"max_von_mises": peak.value, "max_von_mises_at": list(peak.at)}
    singular = other and {"von_mises": other.value, "at": list(other.at), "what": other.what}
    return {
        **_largest(spline, "displacement", np.linalg.norm(moved, axis=2)),
        **found_there,
        "max_von_mises_on": peak.on if peak else "",
        "max_von_mises_error": peak and peak.error,
        "stress_error": found.stress_error,
        "singular": singular,
        "poor_elements": found.poor,
        "load": found.load.tolist(),
        "reactions": [
            {"at": name, "force": force}
            for name, force in zip(found.supports, found.reactions.tolist(), strict=True)
        ],
        "strain_energy": found.strain_energy,
        "mass": found.mass,
    }


def _poisson(spline: Spline, found: Potential) -> dict[str, object]:
    u = samples(spline, (spline.extraction @ found.values)[:, None])[..., 0]
    flux = np.linalg.norm(samples(spline, found.flux), axis=2)
    return {
        **_largest(spline, "u", u),
        "min_u": float(u.min()),
        **_largest(spline, "flux", flux),
        "flows": [
            {"at": name, "flow": flow}
            for name, flow in zip(found.supports, found.flows.tolist(), strict=True)
        ],
        "supplied": found.supplied,
    }


def _largest(spline: Spline, name: str, values: np.ndarray) -> dict[str, object]:
    """Largest of values (E, 64) at the sample points of the elements, with its place."""
    element, place = np.unravel_index(values.argmax(), values.shape)
    at = samples(spline, spline.extraction @ spline.control)[element, place]
    return {f"max_{name}": float(values.max()), f"max_{name}_at": at.tolist()}


def tile(report: Json) -> dict[str, str | None]:
    """The main number of the solution for the top of the page, by name."""
    if "modes" in report:
        found = report["modes"]
        elastic = found["frequency_hz"][found.get("rigid", 6) :]
        unit = found.get("units", {}).get("frequency", "")
        first = _frequency(elastic[0], unit) if elastic else None
        return {"first elastic frequency": first}
    if "static" in report:
        found = report["static"]
        return {"largest von Mises stress": largest(found)}
    if "poisson" in report:
        found = report["poisson"]
        return {"u": f"{show(found['min_u'])} to {show(found['max_u'])}"}
    return {}


def section_of(state: RunState, report: Json, pictures: Pictures) -> str:
    """The section of the solution; empty if there is none."""
    found = state.solution
    if isinstance(found, Modes):
        return _modes_section(found, pictures)
    if isinstance(found, Deformation) and state.spline is not None:
        return _static_section(state.spline, found, report["static"], pictures)
    if isinstance(found, Potential):
        return _poisson_section(report["poisson"], pictures)
    return ""


def _modes_section(found: Modes, pictures: Pictures) -> str:
    """Frequencies, and animations of the first elastic modes."""
    units = dict(found.units)
    frequency = f"frequency, {units.get('frequency', 'cycles per unit of time')}"
    first = first_elastic(found) if found.rigid else 0
    rows = [
        {
            "mode": i + 1,
            "omega squared": float(value),
            frequency: float(found.frequency[i]),
            "": "rigid motion" if i < first else "",
        }
        for i, value in enumerate(found.eigenvalues)
    ]
    pictured = [
        figure(
            pictures.get(f"mode_{i}"),
            f"Mode {i + 1}: {_frequency(found.frequency[i], units.get('frequency', ''))}",
            gradient(DISPLACEMENT_COLOURS, "at rest", "largest"),
        )
        for i in range(len(rows))
    ]
    about = {"mass": float(found.mass), "units": units or None}
    return section("modes", "Eigenmodes", grid(*pictured), table(rows), facts(about))


def _static_section(spline: Spline, found: Deformation, told: Json, pictures: Pictures) -> str:
    """The deformed solid, the largest values with their places, and the reactions."""
    units = found.units
    points = spline.extraction @ spline.control
    times = exaggeration(points, told["max_displacement"])
    caption = f"Displacement drawn {times:.3g} times as large; von Mises stress."
    legend = gradient(FIELD_COLOURS, "0", megapascal(told["max_von_mises"]))
    rows = [
        {"at": row["at"], **{f"{axis}, N": row["force"][i] for i, axis in enumerate("xyz")}}
        for row in [*told["reactions"], {"at": "loads", "force": told["load"]}]
    ]
    notes = [*beside(told), *cautions({"static": told})]
    about = {
        f"largest displacement, {units['length']}": told["max_displacement"],
        "at": told["max_displacement_at"],
        "largest von Mises stress": largest(told),
        "there at": told["max_von_mises_at"],
        "on": told["max_von_mises_on"] or None,
        "estimated error of the stress field": told["stress_error"],
        "strain energy, J": told["strain_energy"],
        "mass, kg": told["mass"],
    }
    return section(
        "static",
        "At rest under load",
        grid(figure(pictures.get("static"), caption, legend), facts(about)),
        *(f"<p>{escape(said[0].upper() + said[1:])}.</p>" for said in notes),
        "<h3>Reactions, and all loads together</h3>",
        table(rows),
    )


def _poisson_section(told: Json, pictures: Pictures) -> str:
    """u on the surface, and the flow through each support."""
    legend = gradient(FIELD_COLOURS, show(told["min_u"]), show(told["max_u"]))
    rows = [{"at": row["at"], "into the solid, W": row["flow"]} for row in told["flows"]]
    rows.append({"at": "sources and given fluxes", "into the solid, W": told["supplied"]})
    about = {
        "u": [told["min_u"], told["max_u"]],
        "largest at": told["max_u_at"],
        "largest flux, W/m^2": told["max_flux"],
        "there at": told["max_flux_at"],
    }
    return section(
        "poisson",
        "Potential",
        grid(figure(pictures.get("poisson"), "u on the surface.", legend), facts(about)),
        "<h3>Flows</h3>",
        table(rows),
    )


def _frequency(value: float, unit: str) -> str:
    """Frequency in Hz, kHz or MHz."""
    if unit == "Hz" and value >= 1e4:
        return f"{value / 1e6:.4g} MHz" if value >= 1e6 else f"{value / 1e3:.4g} kHz"
    return f"{show(value)} {unit}".strip()
