"""What the studies found."""

from .tables import show_notices, table


def show_bodies(document: dict, run) -> None:
    """What section VI counts."""
    linear, total = document["linear"], document["bodies"]
    print(f"{total} random bodies, {document['reading']}")
    print(
        f"linear least squares: {linear['nonphysical_count']} not physical ({100 * linear['nonphysical']:.1f} %), {linear['negative_mass']} of negative mass, "
        f"{linear['inertia_not_positive']} with inertia not positive, {linear['triangle_violated']} violate a triangle inequality (about the centre of mass)"
    )
    rows = []
    for name, entry in document["parameterizations"].items():
        low, high = entry["range_90"]
        rows.append([name, f"{entry['median_iterations']:g}", f"{low:g} to {high:g}", str(entry["failures"]), f"{entry['seconds_per_iteration']:.1e}", f"{entry['newton']['median_iterations']:g}"])
    heads = ["parameterization", "median", "5 % to 95 %", "not converged", "s per iteration", "own solver: median"]
    table("iterations until convergence", heads, rows)
    print(f"figures and tables: {run}")


def show_restarts(document: dict, run) -> None:
    """Where the random starts began and ended."""
    first, last = document["initial_rms_train"], document["rms_test"]
    print(f"{document['restarts']} random starts, training RMS at the start {min(first):.3g} to {max(first):.3g} N m")
    print(f"{document['converged']} converged, {document['globally_optimal']} proven globally optimal, after {min(document['iterations'])} to {max(document['iterations'])} iterations")
    print(f"objective {min(document['objective']):.10g}, relative spread {document['relative_spread']:.1e}; RMS on test logs {min(last):.6g} to {max(last):.6g} N m")
    print(f"figure and table: {run}")
    show_notices(document)


def show_prior(document: dict, run) -> None:
    """The curve of held-out error against the prior's weight."""
    for weight, rms in zip(document["weights"], document["rms_held_out"]):
        marks = [text for value, text in ((document["chosen"], "least"), (document["experiment_weight"], "this experiment")) if value == weight]
        print(f"{weight:8.0e}  held-out RMS {rms:.6g} N m  {', '.join(marks)}".rstrip())
    print(f"strongest prior within one standard error of the least: {document['largest_within_one_se']:g}")
    print(f"curve: {run}")
    show_notices(document)
