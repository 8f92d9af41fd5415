"""The paper's loop: a measurement is taken as the posture at the time at which it arrives."""

from miro_host.estimators.interface import Estimate, Estimator, EstimatorInput, EstimatorParameters


class NoEstimator(EstimatorParameters, frozen=True, kw_only=True, tag="none"):
    """No parameters."""

    def estimator(self) -> "Unchanged":
        return Unchanged(self)


class Unchanged(Estimator[NoEstimator]):
    """Hands on what the camera gives."""

    def step(self, given: EstimatorInput) -> Estimate | None:
        return None if given.measured is None else Estimate(given.t_s, given.measured)
