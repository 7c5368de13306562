# SPDX-License-Identifier: Apache-2.0
"""Sessions: bake once, edit, update exactly."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from deltalux import _core, core_session
from deltalux.errors import FormatError, OptionError
from deltalux.planning import Plan, machine_constants, read_plan
from deltalux.results import Frame, Result
from deltalux.samples import Samples
from deltalux.samples.interpolation import Interpolators
from deltalux.scene import Mesh, Scene, rigid_pose
from deltalux.scene.editing import with_edits
from deltalux.scene.flatten import flatten
from deltalux.segments import Progress, check_threads
from deltalux.session_options import SessionOptions, checked_options, takes
from deltalux.stored import snapshot
from deltalux.units import PHOTOPIC_WEIGHTS

from .calls import Calls, long_call, short_call
from .places import SessionPlaces

if TYPE_CHECKING:
    from typing_extensions import Self, Unpack


@takes(SessionOptions)
class Session(SessionPlaces):
    """Global illumination of a scene at samples, kept exact under edits.

    Parameters
    ----------
    scene : Scene
    samples : Samples or None
        None: on the vertices of the scene's display mesh.
    {options}
    progress : callable (stage, fraction) -> keep going, or None
        Called on the calling thread about 50 times a second; returning False cancels.

    Raises
    ------
    OptionError, SceneError
    """

    def __init__(
        self,
        scene: Scene,
        samples: Samples | None = None,
        *,
        progress: Progress | None = None,
        **options: Unpack[SessionOptions],
    ) -> None:
        own = Samples.on_vertices(scene) if samples is None else samples
        if own.display is not None and (misfit := own.display.misfit(scene)):
            raise OptionError(
                f"samples: found those of the vertices of another scene ({misfit}); make them with "
                "Samples.on_vertices(scene) of this one, or give points, normals and attachments alone"
            )
        self._options = checked_options(options, len(own))
        self.scene = scene
        self.samples = own
        self.progress = progress
        self._flat = flatten(scene)
        self._core = self._make_core()
        self._poses = {m.name: m.pose for m in scene.meshes if m.movable}
        self._removed: set[str] = set()
        self._factors = dict.fromkeys(self._flat.groups, 1.0)
        self._reflectances = {m.name: tuple(m.reflectance.tolist()) for m in scene.materials}
        self._box = self._core.world() + self._flat.origin
        self._edits = _core.EditList()
        self._calls = Calls()
        # commands that wrote the file that this session comes from, oldest first
        self.made_by: tuple[str, ...] = ()
        self._built_by: str | None = None  # the build that computed the light
        self.foreign_build: str | None = None  # build that computed the light, if not this one
        self._irradiance: np.ndarray | None = None
        self._result: tuple[np.ndarray, np.ndarray] | None = None  # irradiance and standard error
        self._gain = 1.0  # of the same reading
        self._interpolators = Interpolators()

    def _make_core(self) -> Any:
        return core_session.make_core_session(self.scene, self._flat, self.samples, self._options)

    def _another(self, scene: Scene, samples: Samples | None) -> Session:
        """A session of another scene with the same options."""
        return Session(scene, samples, progress=self.progress, **self._options)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()

    def close(self) -> None:
        """Free the session's memory; results that were read stay valid."""
        self._core = None

    def __reduce_ex__(self, protocol: Any) -> Any:
        """Refuse to be pickled or copied."""
        raise OptionError(
            "session: it cannot be pickled or copied; save it to a file, and open that with Session.open"
        )

    def _object(self, name: str) -> int:
        return core_session.movable_index(self.scene, self._flat, name)

    def _queue(self, kind: str, *values: Any) -> None:
        """Check and queue an edit of the core; a Mesh among `values` becomes an object of the core."""
        edit, own = _core.EditList(), [self._flat.object(v) if isinstance(v, Mesh) else v for v in values]
        getattr(edit, kind)(*own)
        self._session().check(edit, self._edits)
        getattr(self._edits, kind)(*own)

    def pose(self, name: str) -> np.ndarray:
        """Pose of a movable (4x4, local to world), including queued edits."""
        self._object(name)
        return self._poses[name].copy()

    @short_call
    def move(self, name: str, pose: Any) -> None:
        """Queue: put the movable `name` at the absolute, rigid `pose`.

        Raises
        ------
        OptionError
            For an unknown or static name, a pose that is not rigid, or one beyond 1e15 m; also for one
            outside of `box` if a sun's paths do not pass there, or if other sessions hold paths.
        """
        index = self._object(name)
        matrix = rigid_pose(pose, f'move "{name}": pose')
        self._queue("move", index, core_session.core_pose(self.scene, self._flat, name, matrix))
        self._poses[name] = matrix

    @short_call
    def remove(self, name: str) -> None:
        """Queue: remove a movable. Its samples then read 0, and a lamp no longer gives light."""
        index = self._object(name)
        if name in self._removed:
            raise OptionError(f'remove "{name}": it is removed already')
        self._queue("present", index, False)
        self._removed.add(name)

    @short_call
    def add(self, item: str | Mesh) -> None:
        """Queue: put a removed movable back where it was, or insert a new movable mesh.

        Its light belongs to the group of each emissive material, else to a new light group of the mesh's
        name, at factor 1.

        Raises
        ------
        OptionError
            For a name that is not a removed movable; for a mesh that is not movable, whose name is
            taken, or whose materials the scene does not have.
        """
        if isinstance(item, str):
            index = self._object(item)
            if item not in self._removed:
                raise OptionError(f'add "{item}": it is in the scene already')
            self._queue("present", index, True)
            self._removed.discard(item)
            return
        if not isinstance(item, Mesh):
            raise OptionError(f"add: found {type(item).__name__}, expected a name or a Mesh")
        self._insert(item)

    def _insert(self, mesh: Mesh) -> None:
        core_session.check_insertion(mesh, self._flat)
        self._baked_session()
        scene = self.scene.with_mesh(mesh)
        self._queue("insert", mesh)
        self.scene = scene
        self._flat.groups = self._flat.groups_with(mesh)
        self._flat.scene = scene
        self._flat.objects[mesh.name] = len(self._flat.objects)
        self._factors = dict.fromkeys(self._flat.groups, 1.0) | self._factors
        self._poses[mesh.name] = mesh.pose

    @short_call
    def dim(self, group: str, factor: float) -> None:
        """Queue: set a light group to `factor` of its loaded power (absolute, 1 = as loaded)."""
        if group not in (known := self._flat.groups):
            raise OptionError(f'dim "{group}": no such light group, expected one of {list(known)}')
        self._queue("dim", self._flat.groups[group], float(factor))
        self._factors[group] = float(factor)

    @short_call
    def set_reflectance(self, material: str, reflectance: Any) -> None:
        """Queue: change a material's reflectance (3 values, 0 to 1)."""
        self.scene.material(material)
        values = np.asarray(reflectance, np.float64)
        if values.shape != (3,) or not np.isfinite(values).all():
            raise OptionError(f'set_reflectance "{material}": found {reflectance!r}, expected 3 numbers')
        self._queue("reflectance", self._flat.materials[material], tuple(values.astype(np.float32).tolist()))
        self._reflectances[material] = tuple(values.tolist())

    # ---- work ---------------------------------------------------------------------------------

    @long_call
    def bake(self) -> Frame:
        """Compute everything.

        What it chooses (guides, numbers of rays, shares of paths) depends on no edit: on what does not move,
        and on lamps and reflectances as they were loaded. So a bake after any edits has the bits of an
        `update`. If this is cancelled, the session stays as it was.
        """
        return self._bake()

    def _bake(self) -> Frame:
        self._apply_at_once()
        self._forget_results()
        self._prepare_choice()
        session = self._session()
        had_light = session.baked
        try:
            frame = Frame(**session.bake(self.progress), rebake_gain=1.0 if session.is_as_loaded else None)
        except BaseException:
            # the callback failed, or Ctrl-C was pressed, after the bake had finished
            if session.baked and not had_light:
                self._built_by = core_session.description()
            raise
        self.foreign_build, self._built_by = None, core_session.description()
        return frame

    @long_call
    def rebake(self, scene: Scene | None = None, samples: Samples | None = None) -> Frame:
        """Bake another version of the scene, for example with more movables or lamps; edits so far are kept.

        That is a new bake of the session's options: poses, removed movables, dim factors and reflectances of
        what `scene` has, too, are those of now. If it fails or is cancelled, the session stays as it was.

        Parameters
        ----------
        scene : Scene or None
            None: this one with poses and reflectances of now as loaded, for which guides and numbers of rays
            are then chosen; see `rebake_gain`.
        samples : Samples or None
            None: on the vertices of the scene's display mesh, or, without a scene, those of now.

        Raises
        ------
        OptionError, SceneError
        """
        if scene is None:
            scene = with_edits(self.scene, self._poses, (), {}, self._reflectances)
            samples = samples or self.samples
        other = self._another(scene, samples)
        try:
            self._repeat_edits(other)
            frame = other._bake()
        except BaseException:
            other.close()
            raise
        other.made_by = self.made_by
        self.__dict__.update({name: value for name, value in vars(other).items() if name != "_calls"})
        return frame

    def _repeat_edits(self, other: Session) -> None:
        """Queue in `other` what the edits here, done and queued, made of what both have."""
        for name in self._poses.keys() & other._poses.keys():
            if not np.array_equal(self._poses[name], other._poses[name]):
                other.move(name, self._poses[name])
            if name in self._removed:
                other.remove(name)
        for group in self._factors.keys() & other._factors.keys():
            if self._factors[group] != other._factors[group]:
                other.dim(group, self._factors[group])
        for material in self._reflectances.keys() & other._reflectances.keys():
            if self._reflectances[material] != other._reflectances[material]:
                other.set_reflectance(material, self._reflectances[material])

    def _prepare_choice(self) -> None:
        """If the options leave the methods to the core, measure the constants of its cost model.

        Sessions that gather rarely count light in discs: for the few lights without shadow rays, typical
        constants do.
        """
        asked = (self._options["static_method"], self._options["moving_method"])
        discs = self._options["gather"] == "off" or self._options["direct"] == "paths"
        if discs and "auto" in asked:
            self._session().set_planning(machine_constants(self.progress), "measured", None, False)

    @property
    @short_call
    def plan(self) -> Plan:
        """The methods in use since the last bake, with the reasons; `print(session.plan)`.

        Methods that cannot save a tenth of the time are not piloted, so that planning takes a small part
        of the bake; `dl.plan` runs them all.
        """
        names = {number: name for name, number in self._flat.objects.items()}
        asked = {False: self._options["static_method"], True: self._options["moving_method"]}
        return read_plan(self._baked_session().plans, names, asked, "measured", False, 0.0)

    def _apply_at_once(self) -> None:
        """Apply the queued edits, without progress; only Ctrl-C can stop this."""
        if len(self._edits):
            self._apply(self._session(), 0.0, None)

    def _apply(self, session: Any, budget_ms: float, progress: Progress | None) -> dict[str, Any]:
        """Hand the queued edits to the core; if it stops before they took effect, they stay queued."""
        self._forget_results()
        try:
            return session.update(self._edits, budget_ms, progress)
        finally:
            if session.edits_applied:
                self._edits = _core.EditList()

    @long_call
    def update(self, budget_ms: float | None = None) -> Frame:
        """Apply the queued edits together and update every sample exactly.

        Parameters
        ----------
        budget_ms : stop after about this time; the next call continues with the rest (see `Frame.done`).
        """
        return self._update(budget_ms)

    def _update(self, budget_ms: float | None = None) -> Frame:
        session = self._baked_session()
        if self.foreign_build is not None:
            raise OptionError(
                f"session: its light was computed by another build ({self.foreign_build}), whose bits may "
                "differ; call recompute() once before the next edit"
            )
        if budget_ms is not None and not budget_ms > 0:
            raise OptionError(f"budget_ms: found {budget_ms}, expected a positive number, or None")
        return Frame(**self._apply(session, budget_ms or 0.0, self.progress))

    @long_call
    def recompute(self) -> Frame:
        """Compute everything again from scratch in the present state; the digest must not change.

        What the bake chose stays: guides, numbers of rays, radii.
        """
        if self.foreign_build is not None:
            return self._bake()
        self._finish()
        self._forget_results()
        frame = self._session().recompute(self.progress)
        if self._options["path_range"] is not None:  # others have the rest of the light
            return Frame(**frame)
        self._read()
        return Frame(**frame, rebake_gain=self._gain)

    def _finish(self) -> None:
        """Apply queued edits and finish pending work."""
        session = self._baked_session()
        if len(self._edits) or session.pending > 0:
            self._update()

    # ---- results ------------------------------------------------------------------------------

    @long_call
    def read(self) -> tuple[np.ndarray, np.ndarray]:
        """`irradiance` and `standard_error`, without copying them; read-only."""
        return self._read()

    def _read(self) -> tuple[np.ndarray, np.ndarray]:
        if self._result is None:
            *arrays, self._gain = self._baked_session().read()
            self._result = arrays[0], arrays[1]
            for array in self._result:
                array.setflags(write=False)
            self._irradiance = self._result[0]
        return self._result

    def _read_irradiance(self) -> np.ndarray:
        if self._irradiance is None:
            self._irradiance = self._baked_session().read_irradiance()
        return self._irradiance

    def _forget_results(self) -> None:
        self._irradiance = self._result = None

    @long_call
    def read_packed(self, *, errors: bool = True) -> np.ndarray:
        """(n, 4) float32, for displays: irradiance, and its photopic standard error with correlated channels.

        Without `errors` the fourth value is 0, and the call takes half the time, in a session that gathers a
        sixth of it.
        """
        return self._baked_session().read_packed(PHOTOPIC_WEIGHTS.tolist(), errors)

    @long_call
    def glance(self) -> np.ndarray:
        """(n, 4) float32, for displays during a drag: a faster `read_packed` without errors.

        After an update that moved something, gathered light is read where rays were cast again and, in turn,
        at an eighth of the other samples; the rest keep the values of the last `glance`.
        """
        return self._baked_session().glance()

    @property
    @long_call
    def irradiance(self) -> np.ndarray:
        """(n, 3) float64, unit of the scene, as of the last bake or update.

        Reading it is faster than `standard_error` and `read`: in a session that gathers it takes a sixth of
        the time.
        """
        return self._read_irradiance().copy()

    @property
    def standard_error(self) -> np.ndarray:
        """(n, 3) float64: standard error by independent batches of paths; with a gather, of its rays, too."""
        return self.read()[1].copy()

    @property
    @long_call
    def rebake_gain(self) -> float:
        """By about which factor `rebake()` could reduce the standard error; 1 = nothing to gain.

        Rays are aimed at places that lamps light where they were loaded. If a lamp moves, comes, or shines on
        something painted anew, few rays hit its pool, and each brings much. This is the RMS of the relative
        standard error over what it would be without such rays. A new bake may need them, too, so that less is
        gained. While lamps and reflectances are as loaded, it is 1.
        """
        self._read()
        return self._gain

    @property
    @long_call
    def radius(self) -> np.ndarray:
        """(n,) float64 disc radii, metres; automatic ones are NaN before the bake.

        In a session without discs, they are chosen when they are first asked for.
        """
        return self._session().radii(self.progress).astype(np.float64)

    @property
    @long_call
    def gradient(self) -> np.ndarray:
        """(n, 3, 3) float64: surface gradient per channel (sample, channel, axis), per metre.

        Computed from the crossings of the samples' discs, also in a session that gathers: it makes them for
        the first gradient and keeps them for the next, unless an update comes between when memory is short.
        """
        return self._gradient()

    def _gradient(self) -> np.ndarray:
        return self._baked_session().gradient(self.progress)

    @property
    def result(self) -> Result:
        """A record of the present results that does not depend on the session."""
        about = {key: value for key, value in self._options.items() if value is not None}
        irradiance, error = (values.copy() for values in self.read())
        return Result(*self.world(), irradiance, error, self.radius, self.scene.unit, about)

    @long_call
    def digest(self) -> str:
        """Hex string over sums, segments, poses, dim factors and reflectances; finishes pending work.

        It is equal for two sessions in the same state, whatever their numbers of threads are. Their edit
        histories may differ, too, if both were baked in the same state: a bake fixes each sample's ray
        directions.
        """
        self._finish()
        return self._session().digest()

    # ---- files --------------------------------------------------------------------------------

    @long_call
    def save(self, path: str | Path, command: str = "Session.save") -> None:
        """Write the session to one file (.dlx), under a temporary name first. Finishes pending work.

        The file keeps `command` and the commands of the files that it comes from: see `made_by`.
        """
        if self._session().baked:
            self._finish()
        else:
            self._apply_at_once()
        self._write(Path(path), command)

    def _write(self, path: Path, command: str = "Session.save") -> None:
        """Write the present state, work that waits included."""
        reflectances = [self._reflectances[m.name] for m in self.scene.materials]
        stored = snapshot.StoredSession(
            self.scene,
            self.samples,
            self._options,
            self.baked,
            np.array(reflectances, np.float64).reshape(-1, 3),
            self._built_by,
            self.made_by,
        )
        snapshot.write(path, stored, self._session(), command, self.progress)

    @classmethod
    def open(cls, path: str | Path, *, threads: int | None = None, progress: Progress | None = None) -> Self:
        """Open a saved session; moving an object then traces only the paths that the move affects.

        Raises
        ------
        FormatError
            For a file that is missing, truncated, foreign or of another version.
        """
        return cls._open(path, threads, progress)

    @classmethod
    def _open(cls, path: str | Path, threads: int | None, progress: Progress | None, **own: Any) -> Self:
        """`open`, with arguments of the constructor of a derived class."""
        check_threads(threads)
        with snapshot.opened(Path(path), progress) as file:
            options = file.stored.options.copy()
            if threads is not None:
                options["threads"] = threads
            session = cls(file.stored.scene, file.stored.samples, progress=file.progress, **own, **options)
            session._restore(file.stored, file.core_arrays)
        session.progress = progress
        return session

    def _restore(self, stored: snapshot.StoredSession, arrays: snapshot.CoreArrays) -> None:
        """Take over the light and the state that a file holds."""
        self._prepare_choice()
        core = self._session()
        core.restore(arrays, self.progress)
        if core.baked != stored.baked:
            raise FormatError("found light in one of index and arrays only")
        state = core_session.present_state(core, self._flat)
        if not np.array_equal(stored.reflectances.astype(np.float32), state.reflectances):
            raise FormatError("found other reflectances in the index than in the arrays")
        names = [m.name for m in self.scene.materials]
        self._poses, self._removed, self._factors = state.poses, state.removed, state.factors
        self._reflectances = dict(zip(names, map(tuple, stored.reflectances.tolist()), strict=True))
        self._box = core.world() + self._flat.origin
        self.made_by, self._built_by = stored.made_by, stored.built_by
        present_build = core_session.description()
        if self._built_by not in (None, present_build):
            self.foreign_build = f"{self._built_by}; this is {present_build}"

    def _repr_html_(self) -> str:
        return self.result._repr_html_() if self.baked else f"<p>{self!r}</p>"
