"""Which files are ours to replace: those that say so, and nothing that only bears our names.

A file is taken for ours by what it says: the digest of a gait (`gait_digest`), or what files of its
kind begin with. Whatever else lies where a result is to go is left alone, and so is the result.
"""

from __future__ import annotations

import os
import re
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from human_gait.exceptions import ResultError
from human_gait.results.folder import replaced_folder
from human_gait.results.names import AGREEMENT, EXPORT, GAIT_FILE
from human_gait.results.reading import read_regular
from human_gait.results.sealed import MARK

_HEAD = 2**16  # bytes in which a file says what it is
_DIGEST = rb"\b" + MARK + rb'\b|"gaits": \{'
_BEGINNINGS = (  # of files of all versions that have no digest
    rb"\APK.*format\.npy.*about\.npy",  # gait.npz
    rb"\APK.*(?:joint limit|ZMP stability|contact position|__gait__|__names__)\.npy",
    rb'"solver_status": .*"walking_speed_m_per_s": ',
    rb'"price_unit": "N\^2 m\^2 s per unit of the bound"',
    rb'"cost_relative_to_first": ',
    rb'\A\{\s+"angles off the splines": ',
    rb"\Agait_cycle_percent,pelvis_tilt_anterior_deg",
    rb"\Areference,curve,r,rmse,rmse_offset_free,",
    rb'"scores": \[\s+\{\s+"reference": .*"rmse_offset_free": ',
    rb"<title>[^<]* \xe2\x80\x93 predicted walking</title>",  # report.html
    rb"<title>[^<]* \xe2\x80\x93 findings of a study</title>",  # report.html of a study
    rb"--accent: #0a62a8; --on-accent: #fff;",  # playback.html
    rb'<Model name="human">',
    rb'<ExternalLoads name="ground_reaction">',
    rb'<robot name="human"',
    rb"units: s, m, (?:deg|N, N m)\nendheader\ntime\t(?:pelvis_tz|ground_force_r_vx)",
    rb"\tmarkers\.trc\n.*\tLFHD\t\t\tRFHD\t\t\tLBHD\t\t\tRBHD\t\t\tC7\t",
    rb"\A..*POINT.*LFHD.*on head",  # markers.c3d
    rb"\AHIERARCHY\s+ROOT pelvis\s.*JOINT thigh_r\s",
    rb"\Atime_s,(?:pelvis_tz_m|hip_flexion_r_net_Nm|right_force_x_N|j01_pelvis_tz/position),",
    rb'"joint_names": \["j01_pelvis_tz", ',
    rb"tEXtSource\0human_gait|<dc:source>human_gait",
)
_SIGN = re.compile(b"|".join((_DIGEST, *_BEGINNINGS)), re.DOTALL)
_PNG = re.compile(rb"\A\x89PNG.{12}(.{4})(.{4}).*tEXtSoftware\0Matplotlib version", re.DOTALL)
_SVG = re.compile(rb'<svg [^>]*width="([\d.]+)pt" height="([\d.]+)pt".*Matplotlib v', re.DOTALL)
_DOTS_PER_POINT = 200 / 72
_SIZES = {  # [dots] of pictures of versions that wrote no source into them
    *((1920, 1240), (1280, 1320), (1920, 1360), (1280, 1080), (1920, 540), (1365, 1885)),
    *((1920, 680), (1280, 1200), (1280, 800), (1920, 840)),
}


def given_path(given: str | Path) -> Path:
    """Return the path that somebody gave; a text without a sign would mean the current folder."""
    if not str(given):
        raise ResultError("an empty path: give a name, or '.' for the current folder")
    return Path(given)


def is_ours(path: Path) -> bool:
    """Tell whether a file was written by us, or is empty so that nothing can be lost with it."""
    try:
        head = read_regular(path, _HEAD)
    except OSError:
        return False
    return not head or bool(_SIGN.search(head)) or _is_picture(head)


def _is_picture(head: bytes) -> bool:
    """Tell whether it is a picture by matplotlib of a size that ours have."""
    if found := _PNG.search(head):
        return tuple(int.from_bytes(side) for side in found.groups()) in _SIZES
    if found := _SVG.search(head):
        return tuple(round(float(side) * _DOTS_PER_POINT) for side in found.groups()) in _SIZES
    return False


def is_result(folder: Path) -> bool:
    """Tell whether there is a result of ours in a folder, of one solver or of several."""
    names = (GAIT_FILE, AGREEMENT)
    return any(_has_content(folder / name) and is_ours(folder / name) for name in names)


def _has_content(path: Path) -> bool:
    try:
        return path.stat().st_size > 0
    except OSError:
        return False


def check_free(folder: Path, written: Iterable[str] = (), removed: Collection[str] = ()) -> None:
    """Raise ResultError where a file that is not ours is in the way.

    Parameters
    ----------
    folder : Path
    written : iterable of str
        What is to be written, as paths in the folder: in place of each there may be nothing but
        a file of ours.
    removed : collection of str
        What goes with an old result: files of ours, beside one.
    """
    for path in (*_in_place_of(folder, written), *_would_go(folder, removed)):
        raise ResultError(
            f"{path}: is in the way: human-gait did not make it, or it is damaged, and it would be "
            "replaced: move it, or choose another place (--out)"
        )


def _in_place_of(folder: Path, names: Iterable[str]) -> Iterator[Path]:
    for name in names:
        path = folder / name
        above = [one for one in path.parents if one.is_relative_to(folder) and one != folder]
        yield from (one for one in reversed(above) if os.path.lexists(one) and not one.is_dir())
        if os.path.lexists(path) and not is_ours(path):
            yield path


def _would_go(folder: Path, names: Collection[str]) -> Iterator[Path]:
    """Yield the files that would be removed though they are not ours, or no result is beside."""
    for name in names:
        path = folder / name
        if not os.path.lexists(path) or (path.is_dir() and not path.is_symlink()):
            continue
        beside = path.parent.parent if path.parent.name == EXPORT else path.parent
        if not is_ours(path) or (_has_content(path) and not is_result(beside)):
            yield path


@contextmanager
def our_folder(folder: Path, derived: Collection[str] = (), solved: bool = True) -> Iterator[Path]:
    """Yield an empty folder whose files replace those in `folder`, if all these are ours.

    The parameters are those of `replaced_folder`.

    Raises
    ------
    ResultError
        If a file that is not ours is in the way, or the new ones cannot be written.
    """
    check_free(folder, removed=derived)
    with replaced_folder(folder, derived, solved) as new:
        yield new
        made = (path for path in new.rglob("*") if not path.is_dir())
        check_free(folder, [str(path.relative_to(new)) for path in made])
