"""Solutions in report.json: modes, static deformation, potential."""

import numpy as np

from polycube.analysis.recovery import samples
from polycube.types import Deformation, Modes, Potential, Solution, Spline


def numbers(spline: Spline, solution: Solution) -> dict[str, dict[str, object]]:
    """Numbers in `report.json` under the name of the analysis: modes, static or poisson."""
    units = {"units": dict(solution.units)}
    if isinstance(solution, Modes):
        found = {
            "omega_squared": solution.eigenvalues.tolist(),
            "frequency_hz": solution.frequency.tolist(),
            "frequency_error": list(solution.errors),
            "rigid": solution.rigid,
            "mass": solution.mass,
        }
        return {"modes": found | units}
    if isinstance(solution, Deformation):
        return {"static": _static(spline, solution) | units}
    return {"poisson": _poisson(spline, solution) | units}


def _static(spline: Spline, found: Deformation) -> dict[str, object]:
    moved = samples(spline, found.displacement)
    peak, singular = found.peak, found.singular
    stress = samples(spline, found.von_mises[:, None])[..., 0]
    largest_stress = _largest(spline, "von_mises", stress)
    if peak is not None:
        largest_stress = {"max_von_mises": peak.value, "max_von_mises_at": list(peak.at)}
    return {
        **_largest(spline, "displacement", np.linalg.norm(moved, axis=2)),
        "displacement_error": found.displacement_error,
        **largest_stress,
        "max_von_mises_on": peak.on if peak else "",
        "max_von_mises_error": peak and peak.error,
        "stress_error": found.stress_error,
        "singular": singular
        and {
            "von_mises": singular.value,
            "at": list(singular.at),
            "what": singular.what,
            "distance": singular.distance,
        },
        "poor_elements": found.poor,
        "load": found.load.tolist(),
        "reactions": [
            {"at": name, "force": force}
            for name, force in zip(found.supports, found.reactions.tolist(), strict=True)
        ],
        "preloads": [
            {"force": force, "section_force": resultant, "tightening": amount}
            for force, resultant, amount in found.sections.tolist()
        ],
        "strain_energy": found.strain_energy,
        "mass": found.mass,
    }


def _poisson(spline: Spline, found: Potential) -> dict[str, object]:
    u = samples(spline, (spline.extraction @ found.values)[:, None])[..., 0]
    return {
        **_largest(spline, "u", u),
        "min_u": float(u.min()),
        "u_error": found.u_error,
        **_largest(spline, "flux", np.linalg.norm(samples(spline, found.flux), axis=2)),
        "flux_error": found.flux_error,
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
