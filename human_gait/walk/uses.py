"""What a person does with a gait: look at curves by name, keep it, export it, draw it.

Each is one call of a module that is made for it. These lie above the gait, which does not depend on
them, so they are looked up when they are used (`late`).
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy.typing as npt

from human_gait.arrays import FloatArray
from human_gait.body.skeleton import DOF_NAMES
from human_gait.late import late

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


class Uses:
    """Methods of a `Gait` that others carry out."""

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the 55 degrees of freedom, in the order of `q` and `tau`.

        The first six are those of the pelvis in the world, the others joints, ``_r`` right and
        ``_l`` left.
        """
        return DOF_NAMES

    @property
    def times(self) -> FloatArray:
        """One stride, left heel strike to left heel strike, in 201 even instants, (201,), [s]."""
        return late("walk.curves", "stride_times")(self)  # type: ignore[no-any-return]

    def keys(self) -> tuple[str, ...]:
        """Return the names of all curves: what ``gait[name]`` takes, and the columns of a table.

        For each degree of freedom ``name`` [rad] or [m], ``name_velocity``, ``name_acceleration``,
        and for each joint ``name_torque`` and ``name_muscle_torque`` [N m]; for both feet
        ``grf_r_x`` ... ``grf_l_z`` [N], ``cop_r_x`` ... ``cop_l_z`` [m], ``yaw_moment_r`` and
        ``_l`` [N m]; and ``zmp_x``, ``zmp_z`` [m].
        """
        return late("walk.curves", "NAMES")  # type: ignore[no-any-return]

    def __iter__(self) -> Iterator[str]:
        return iter(self.keys())

    def __contains__(self, name: object) -> bool:
        return name in self.keys()

    def __getitem__(self, name: str) -> FloatArray:
        """Return a curve by its name, at the instants of `times`.

        Parameters
        ----------
        name : str
            One of `keys`, such as ``knee_flexion_r`` or ``knee_flexion_r_torque``.

        Returns
        -------
        (201,) array, [rad], [m] and their rates, [N m], [N]

        Raises
        ------
        KeyError
            If there is no such curve; with the nearest name.
        """
        return late("walk.curves", "curve")(self, name)  # type: ignore[no-any-return]

    def to_dataframe(self, t: npt.ArrayLike | None = None) -> pd.DataFrame:
        """Return all curves as a pandas table: a row for each time, a column for each name.

        Parameters
        ----------
        t : (K,) array, [s], optional
            Times >= 0; by default one stride, `times`.

        Returns
        -------
        DataFrame
            Its index is the time [s]; its columns are `keys`, units as there.

        Raises
        ------
        ImportError
            If pandas is not installed; it says how to install it.
        ValueError
            If a time is negative or not finite.
        """
        return late("walk.curves", "to_dataframe")(self, t)

    def save(self, folder: str | Path) -> Path:
        """Write the gait to a folder as a result, but for its pictures, and return the folder.

        All commands take it (``human-gait verify``, ``report`` ...), so does `load`; ``human-gait
        plot`` adds the pictures. It replaces what there was of an older result, whole or not at
        all; other files stay.

        Parameters
        ----------
        folder : str or Path

        Raises
        ------
        ResultError
            If it cannot be written.
        """
        return late("walks", "save")(self, folder)  # type: ignore[no-any-return]

    def export(
        self,
        folder: str | Path,
        formats: str | Collection[str] | None = None,
        rate: float | None = None,
    ) -> list[Path]:
        """Write one stride for other programs and return the paths of the files.

        Parameters
        ----------
        folder : str or Path
        formats : str or collection of str, optional
            Of ``osim mot grf sto trc c3d bvh csv urdf``; all by default.
        rate : float, [Hz], optional
            Samples per second, 10 to 10000; by default 1000 in OpenSim's tables and else 100.

        Raises
        ------
        ValueError
            If there is no such format or the rate is out of range.
        ResultError
            If the files cannot be written; what was there is then as it was.
        """
        return late("export.formats", "export")(self, folder, formats, rate)  # type: ignore[no-any-return]

    def plot(self, name: str = "joint_angles") -> Figure:
        """Return a picture of the walk; a notebook shows it, ``.savefig(path)`` writes it.

        Parameters
        ----------
        name : str
            ``stick_diagram``, ``joint_torques``, ``joint_angles``, ``ground_reaction`` or ``zmp``.

        Raises
        ------
        ValueError
            If there is no such picture.
        """
        return late("pictures.plots", "plot")(self, name)  # type: ignore[no-any-return]

    def __repr__(self) -> str:
        return late("walk.described", "gait_text")(self)  # type: ignore[no-any-return]

    def _repr_html_(self) -> str:
        return late("walk.described", "gait_html")(self)  # type: ignore[no-any-return]
