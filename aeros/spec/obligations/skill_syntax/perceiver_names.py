"""Names that perceivers may use: those of skills without actions, and members of numpy that compute.

None of the listed members of numpy reads or writes a file, runs text as code, takes an address, or changes
a setting that other code shares.  `frombuffer`, `ndarray`, `dtype` and the attribute `view` are left out,
because they read memory as another type; `save`, `load`, `memmap`, `ctypeslib` and `lib` reach files and
libraries.
"""

from __future__ import annotations

from typing import Final

from aeros.spec.obligations.skill_syntax.allowed_names import (
    ALLOWED_ATTRIBUTES,
    ALLOWED_MEMBERS,
    SKILL_INTERFACE,
    AllowedNames,
    split_names,
)

PERCEPTION_INTERFACE: Final = "aeros.perception"

INTERFACE_MEMBERS: Final = split_names(
    "BoxPose CameraError Circle CylinderPose Estimate Level Mask Perception Picture Plane "
    "Points Rectangle Sample View believe_height connected_components correct_points erode "
    "estimate find_ground find_level_disc find_plane fit_camera_error fit_circle fit_plane "
    "has_colour_of has_dominant_colour has_hsv_colour has_red_ratios has_size heap_volume "
    "heights_above inlier_mask is_lit_for largest_component largest_gap level_ground locate_box "
    "locate_cylinder mean_nearby min_area_rectangle point_cloud seen_cells separate_parts "
    "smooth_colours to_hsv top_face top_points trim_to_plane upper_points without_specks wrap_heading"
)
"""Members of the interface of perceivers, with its toolkit."""

MODEL_MEMBERS: Final = split_names("Model ModelError Models")
"""Members of the interface of skills that perceivers may use, too."""

NUMPY_MEMBERS: Final = split_names(
    # constants and element types
    "bool_ e euler_gamma float32 float64 inf int8 int16 int32 "
    "int64 intp nan newaxis pi uint8 uint16 uint32 uint64 "
    # new arrays
    "arange array asarray ascontiguousarray diag empty "
    "empty_like eye full full_like identity indices linspace "
    "meshgrid ones ones_like tile zeros zeros_like "
    # forms
    "append atleast_1d atleast_2d atleast_3d broadcast_arrays "
    "broadcast_to column_stack concatenate copy delete "
    "dstack expand_dims flip fliplr flipud hstack insert moveaxis "
    "pad ravel repeat reshape roll rot90 split squeeze "
    "stack swapaxes transpose tril triu vstack "
    # arithmetic, by element
    "abs absolute add arccos arcsin arctan arctan2 cbrt ceil "
    "clip cos cosh deg2rad degrees divide exp exp2 expm1 "
    "fabs floor floor_divide fmax fmin fmod hypot interp "
    "invert left_shift log log10 log1p log2 maximum minimum mod "
    "multiply nan_to_num negative power rad2deg radians reciprocal "
    "remainder right_shift rint round sign sin sinh "
    "sqrt square subtract tan tanh trunc "
    # truth
    "all allclose any array_equal bitwise_and bitwise_or "
    "bitwise_xor equal greater greater_equal isclose isfinite "
    "isin isinf isnan less less_equal logical_and logical_not logical_or logical_xor not_equal where "
    # reductions and statistics
    "amax amin argmax argmin average bincount convolve "
    "corrcoef correlate count_nonzero cov cumprod cumsum diff ediff1d "
    "gradient histogram histogram2d max mean median "
    "min nanargmax nanargmin nanmax nanmean nanmedian nanmin "
    "nanpercentile nanquantile nanstd nansum nanvar percentile prod ptp quantile std sum trapezoid var "
    # order and search
    "argpartition argsort argwhere digitize flatnonzero lexsort nonzero partition searchsorted sort take "
    "take_along_axis unique unravel_index ravel_multi_index "
    # linear algebra
    "cross dot einsum inner kron matmul outer polyfit polyval tensordot trace vdot "
    "linalg"
)
"""Members of numpy that perceivers may use."""

LINALG_MEMBERS: Final = split_names(
    "LinAlgError cholesky cond det eig eigh eigvals eigvalsh "
    "inv lstsq matrix_rank norm pinv qr slogdet solve svd "
    "svdvals"
)
"""Members of `numpy.linalg` that perceivers may use."""

_ARRAY_ATTRIBUTES: Final = split_names(
    "T all any argmax argmin argsort astype clip cumsum "
    "diagonal dot flatten item max mean min nbytes ndim nonzero "
    "ptp ravel repeat reshape round shape size squeeze std sum swapaxes take tolist transpose var"
)
_VIEW_ATTRIBUTES: Final = split_names(
    # views, pictures, samples and estimates
    "camera depth eye field_of_view full_size height pictures "
    "points readings rgb samples target time uncertainty "
    "up width "
    # what the toolkit finds
    "above_ground axis heading height_at length longer_heading middle "
    "normal places position radius residual rotation shift shorter_heading spread tilt top turn x y"
)

PERCEIVER_NAMES: Final = AllowedNames(
    "perceiver",
    {
        **ALLOWED_MEMBERS,
        SKILL_INTERFACE: MODEL_MEMBERS,
        PERCEPTION_INTERFACE: INTERFACE_MEMBERS,
        "numpy": NUMPY_MEMBERS,
        "numpy.linalg": LINALG_MEMBERS,
    },
    ALLOWED_ATTRIBUTES | _ARRAY_ATTRIBUTES | _VIEW_ATTRIBUTES,
    "a perceiver only computes values from the views that it receives",
    "import only from `aeros.perception`, `numpy` and modules such as `math`; of `numpy` use what computes, "
    "as docs/perceivers.md lists it",
)
"""Names that perceivers may use."""
