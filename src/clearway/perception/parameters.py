"""Parameters of the localiser `amcl` and of the mapper, under the names that ROS gives them."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field, model_validator

from clearway.quantities import Finite, NonNegative, Positive, Whole
from clearway.reading.limits import CELLS
from clearway.robots import RobotTable

SAMPLES = 50
"""Of the mapper's proposal, to either side along each axis."""


class AmclParameters(RobotTable):
    """Parameters of AMCL; names and defaults are those of ROS's `amcl` node (`amcl_node.cpp`, `AMCL.cfg`).

    Two defaults differ: the initial covariance is that of a robot which is already localised when it is placed at
    its start (the node's 0.5 m and 15 deg are those of a robot that was just switched on), and the recovery by random
    poses is off, as the node's own documentation recommends.
    """

    TABLE = "localisation.amcl"

    min_particles: Whole = Field(default=100, ge=1)
    max_particles: Whole = Field(default=5000, ge=1, le=1_000_000)
    kld_err: Positive = Field(default=0.01, description="bound on the error between true and estimated distribution")
    kld_z: NonNegative = Field(default=0.99, description="upper standard normal quantile for that bound")
    update_min_d: NonNegative = Field(default=0.2, description="motion along x or y before an update, m")
    update_min_a: NonNegative = Field(default=math.pi / 6, description="turn before an update, rad")
    resample_interval: Whole = Field(default=2, ge=1, description="updates for each resampling")
    selective_resampling: bool = Field(default=False, description="resample only if N_eff is below half")
    recovery_alpha_slow: NonNegative = 0.0
    recovery_alpha_fast: NonNegative = 0.0
    initial_cov_xx: NonNegative = Field(default=0.05**2, description="m^2")
    initial_cov_yy: NonNegative = Field(default=0.05**2, description="m^2")
    initial_cov_aa: NonNegative = Field(default=0.05**2, description="rad^2")

    odom_model_type: Literal["diff", "diff-corrected", "omni", "omni-corrected"] = "diff"
    odom_alpha1: NonNegative = Field(default=0.2, description="rotation's noise from rotation")
    odom_alpha2: NonNegative = Field(default=0.2, description="rotation's noise from translation")
    odom_alpha3: NonNegative = Field(default=0.2, description="translation's noise from translation")
    odom_alpha4: NonNegative = Field(default=0.2, description="translation's noise from rotation")
    odom_alpha5: NonNegative = Field(
        default=0.2, description="noise across the motion from translation, of the omni models only"
    )

    laser_model_type: Literal["likelihood_field", "likelihood_field_prob"] = "likelihood_field"
    laser_min_range: Finite = Field(default=-1.0, description="m; not above 0: the sensor's own")
    laser_max_range: Finite = Field(default=-1.0, description="m; not above 0: the sensor's own")
    laser_max_beams: Whole = Field(default=30, ge=2, le=100_000)
    laser_z_hit: Annotated[float, Field(ge=0, le=1)] = 0.95
    laser_z_short: NonNegative = Field(default=0.1, description="of the beam model; not used")
    laser_z_max: NonNegative = Field(default=0.05, description="of the beam model; not used")
    laser_z_rand: Annotated[float, Field(gt=0, le=1)] = 0.05
    laser_sigma_hit: Positive = Field(default=0.2, description="m")
    laser_lambda_short: NonNegative = Field(default=0.1, description="of the beam model; not used")
    laser_likelihood_max_dist: Positive = Field(default=2.0, le=100.0, description="m")

    @model_validator(mode="after")
    def _ordered(self) -> AmclParameters:
        if self.max_particles < self.min_particles:
            raise ValueError(f"max_particles {self.max_particles} must be at least min_particles {self.min_particles}")
        return self


class MappingParameters(RobotTable):
    """Parameters of the mapper; names and defaults are those of ROS's `slam_gmapping` node.

    The extent is only where the map begins: it grows as the robot sees more. `proposal` is ours: `matched` moves a
    particle to where its scan fits best, as the released GMapping does (it reads the `ll` and `la` values, but its
    scan matching does not use them); `gaussian` draws around that place, as the paper does.
    """

    TABLE = "mapping"

    maxUrange: Positive | None = Field(
        default=None, description="range up to which beams are used, m; default: maxRange"
    )
    maxRange: Positive | None = Field(
        default=None, description="beams beyond it are dropped, m; default: the sensor's less 0.01"
    )
    sigma: Positive = Field(
        default=0.05, description="standard deviation in the score that the scan matching climbs, m"
    )
    kernelSize: Whole = Field(
        default=1, ge=0, le=100, description="cells around a beam's end that are searched for a wall"
    )
    lstep: Positive = Field(default=0.05, description="first step of the climb, m")
    astep: Positive = Field(default=0.05, description="first step of the climb, rad")
    iterations: Whole = Field(default=5, ge=1, le=100, description="halvings of the step")
    lsigma: Positive = Field(default=0.075, description="standard deviation of a beam in the likelihood, m")
    ogain: Positive = Field(default=3.0, description="smooths the particles' weights")
    lskip: Whole = Field(default=0, ge=0, description="beams left out after each one used for matching")
    minimumScore: NonNegative = Field(default=0.0, description="below it the odometry is believed")
    proposal: Literal["matched", "gaussian"] = "matched"
    llsamplerange: NonNegative = Field(default=0.01, description="half width of the sampled proposal, m")
    llsamplestep: Positive = Field(default=0.01, description="m")
    lasamplerange: NonNegative = Field(default=0.005, description="rad")
    lasamplestep: Positive = Field(default=0.005, description="rad")
    srr: NonNegative = Field(default=0.1, description="odometry's error: m per m")
    srt: NonNegative = Field(default=0.2, description="odometry's error: rad per m")
    str: NonNegative = Field(default=0.1, description="odometry's error: m per rad")
    stt: NonNegative = Field(default=0.2, description="odometry's error: rad per rad")
    linearUpdate: NonNegative = Field(default=1.0, description="motion before a scan is used, m")
    angularUpdate: NonNegative = Field(default=0.5, description="turn before a scan is used, rad")
    resampleThreshold: Annotated[float, Field(ge=0, le=1)] = Field(default=0.5, description="of N_eff / particles")
    particles: Whole = Field(default=30, ge=1, le=1000)
    delta: Positive = Field(default=0.05, ge=0.005, description="edge of a cell, m")
    occ_thresh: Annotated[float, Field(ge=0, le=1)] = Field(default=0.25, description="share of hits of a wall's cell")
    xmin: Finite = Field(default=-10.0, description="where the map begins, m from the start")
    ymin: Finite = Field(default=-10.0, description="m from the start")
    xmax: Finite = Field(default=10.0, description="m from the start")
    ymax: Finite = Field(default=10.0, description="m from the start")

    @model_validator(mode="after")
    def _extent(self) -> MappingParameters:
        if self.xmax <= self.xmin or self.ymax <= self.ymin:
            raise ValueError("xmax and ymax must lie above xmin and ymin")
        if (cells := (self.xmax - self.xmin) * (self.ymax - self.ymin) / self.delta**2) > CELLS:
            raise ValueError(f"a map of {cells:.3g} cells is too large to begin with; at most {CELLS:,}")
        for width, step in ((self.llsamplerange, self.llsamplestep), (self.lasamplerange, self.lasamplestep)):
            if width / step > SAMPLES:
                raise ValueError(f"{width / step:.3g} samples to either side are too many; at most {SAMPLES}")
        return self
