"""What one step passes on between its parts: before, within and after Newton's method."""

from dataclasses import dataclass

import casadi as ca

Both = tuple[ca.SX, ca.SX]
"""Of the negative and the positive electrode."""


@dataclass(frozen=True, slots=True)
class Unknown:
    """What Newton's method is after.

    Attributes:
        reactions: in the negative and positive electrode, (n,) each [A/m2].
        gap_V: (2,) phi_s - phi_e of both at the separator.
        salt: (nodes,) that follows from the reactions [mol/m3].
    """

    reactions: Both
    gap_V: ca.SX
    salt: ca.SX

    def vector(self) -> ca.SX:
        """All of it."""
        return ca.vertcat(*self.reactions, self.gap_V, self.salt)


@dataclass(frozen=True, slots=True)
class Side:
    """What a step knows of one electrode before its equations are solved.

    Attributes:
        modes: of the particles (n, modes) for an end current of 0.
        lost: what each mode loses per end current, (n or 1, modes).
        surface: (n,) sum of the modes.
        gain: (n,) sum of what they lose.
        losses_ohm_m2: (n, n) `ElectrodeSymbols.losses_ohm_m2`.
    """

    modes: ca.SX
    lost: ca.SX
    surface: ca.SX
    gain: ca.SX
    losses_ohm_m2: ca.SX

    def all(self) -> list[ca.SX]:
        """One after the other."""
        return [self.modes, self.lost, self.surface, self.gain, self.losses_ohm_m2]


@dataclass(frozen=True, slots=True)
class Ready:
    """What a step knows before its equations are solved.

    Attributes:
        sides: of the negative and positive electrode.
        separator_ohm_m2: () of the electrolyte in it.
        salt: (nodes,) after the step, but for
        response: (nodes, n + p) salt per current that leaves the solid at the end of the step.
        begun: (n, fields) of `Begun`; a 0 without ageing, so that no argument is empty.
    """

    sides: tuple[Side, Side]
    separator_ohm_m2: ca.SX
    salt: ca.SX
    response: ca.SX
    begun: ca.SX

    def all(self) -> list[ca.SX]:
        """One after the other."""
        own = [self.separator_ohm_m2, self.salt, self.response, self.begun]
        return [*self.sides[0].all(), *self.sides[1].all(), *own]

    def alike(self) -> "Ready":
        """Symbols of the same shapes."""
        new = [ca.SX.sym("ready", *value.shape) for value in self.all()]
        return Ready((Side(*new[:5]), Side(*new[5:10])), *new[10:])


@dataclass(frozen=True, slots=True)
class Surface:
    """Of one electrode's particles at the end of a step; all (n,).

    Attributes:
        bare_V: phi_s - phi_e below the films, which the reaction takes.
        needed_V: phi_s - phi_e that the reaction and the films take.
        total: current through the surface, side reactions included [A/m2].
        strip: the part of it that strips plated lithium.
        plated: metallic lithium after the step; empty without ageing.
    """

    bare_V: ca.SX
    needed_V: ca.SX
    total: ca.SX
    strip: ca.SX
    plated: ca.SX
