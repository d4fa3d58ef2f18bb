"""Opens every VTU and PVD file under the given folders with meshio and pyvista, independent readers of the format.

    python tools/check_vtu.py FOLDER...

Fails if a file cannot be read, the readers disagree, an array is missing or not finite, a prism has no positive
volume, or there is no file at all.
"""

import sys
from pathlib import Path

import meshio
import numpy as np
import pyvista

WEDGE = 13


def check_grid(path: Path) -> str:
    """Checks one VTU file, and says in a line what is in it."""
    ours = meshio.read(path)
    grid = pyvista.read(path)
    assert len(ours.points) == grid.n_points > 0, "meshio and pyvista disagree on the number of points"
    assert sum(len(block.data) for block in ours.cells) == grid.n_cells > 0, "no cells, or a different number"
    assert np.array_equal(ours.points, grid.points), "meshio and pyvista disagree on the points"
    assert set(ours.point_data) == set(grid.point_data), "meshio and pyvista disagree on the point arrays"
    for data in (grid.point_data, grid.cell_data):
        for name in data:
            assert np.all(np.isfinite(data[name])), f'array "{name}" is not finite'
    assert np.all(np.isfinite(grid.points)), "points are not finite"

    if not np.all(grid.celltypes == WEDGE):
        return f"{grid.n_points} points, {grid.n_cells} cells"
    for data, names in ((grid.point_data, ["level"]), (grid.cell_data, ["layer", "scaled_jacobian"])):
        for name in names:
            assert name in data, f'no array "{name}"'
    volumes = grid.compute_cell_sizes(length=False, area=False)["Volume"]
    n_inverted = np.count_nonzero(volumes <= 0)
    worst = int(np.argmin(volumes))
    assert n_inverted == 0, f"{n_inverted} prisms are inverted, most prism {worst}: {volumes[worst]:.3g} m³"
    return f"{grid.n_points} points, {grid.n_cells} prisms, {1e6 * volumes.sum():.3f} ml"


def check_series(path: Path) -> str:
    """Checks one PVD file; the grids it names are checked as files of their own."""
    reader = pyvista.get_reader(path)
    times = reader.time_values
    assert len(times) > 0 and np.all(np.diff(times) > 0), "times are missing or do not ascend"
    for time in times:
        reader.set_active_time_value(time)
        assert reader.read()[0].n_cells > 0, f"nothing at time {time}"
    return f"{len(times)} states, {times[0]} to {times[-1]} s"


def main(folders: list[str]) -> int:
    checks = {".vtu": check_grid, ".pvd": check_series}
    files = sorted(p for folder in folders for p in Path(folder).rglob("*") if p.suffix in checks)
    n_failed = 0
    for path in files:
        try:
            print(f"good  {path}: {checks[path.suffix](path)}")
        except Exception as error:  # whatever a reader raises means that the file is not good
            n_failed += 1
            print(f"BAD   {path}: {type(error).__name__}: {error}")
    print(f"{len(files)} files, {n_failed} bad")
    return 1 if n_failed or not files else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
