"""Interface and toolkit of perceivers: views that they receive, values that they yield, and geometry."""

from aeros.perception.boxes import BoxPose, locate_box
from aeros.perception.circles import Circle, fit_circle
from aeros.perception.colours import (
    has_colour_of,
    has_dominant_colour,
    has_hsv_colour,
    has_red_ratios,
    is_lit_for,
    to_hsv,
)
from aeros.perception.components import connected_components, largest_component
from aeros.perception.coverage import heap_volume, largest_gap, seen_cells
from aeros.perception.cylinders import CylinderPose, locate_cylinder
from aeros.perception.level_ground import Level, believe_height, level_ground
from aeros.perception.outliers import inlier_mask
from aeros.perception.own_hand import CameraError, correct_points, find_level_disc, fit_camera_error
from aeros.perception.planes import Plane, find_plane, fit_plane, trim_to_plane
from aeros.perception.points import Mask, Points, point_cloud
from aeros.perception.rectangles import (
    Rectangle,
    has_size,
    min_area_rectangle,
    top_face,
    top_points,
    upper_points,
    wrap_heading,
)
from aeros.perception.smoothing import mean_nearby, smooth_colours, without_specks
from aeros.perception.standing import erode, find_ground, heights_above, separate_parts
from aeros.perception.view import Estimate, Perception, Picture, Sample, View, estimate

__all__ = [
    "BoxPose",
    "CameraError",
    "Circle",
    "CylinderPose",
    "Estimate",
    "Level",
    "Mask",
    "Perception",
    "Picture",
    "Plane",
    "Points",
    "Rectangle",
    "Sample",
    "View",
    "believe_height",
    "connected_components",
    "correct_points",
    "erode",
    "estimate",
    "find_ground",
    "find_level_disc",
    "find_plane",
    "fit_camera_error",
    "fit_circle",
    "fit_plane",
    "has_colour_of",
    "has_dominant_colour",
    "has_hsv_colour",
    "has_red_ratios",
    "has_size",
    "heap_volume",
    "heights_above",
    "inlier_mask",
    "is_lit_for",
    "largest_component",
    "largest_gap",
    "level_ground",
    "locate_box",
    "locate_cylinder",
    "mean_nearby",
    "min_area_rectangle",
    "point_cloud",
    "seen_cells",
    "separate_parts",
    "smooth_colours",
    "to_hsv",
    "top_face",
    "top_points",
    "trim_to_plane",
    "upper_points",
    "without_specks",
    "wrap_heading",
]
