"""What the paper prints: Kósa, Mikula, Direct simple computation of middle surface ..., 2023, Tables 2 to 8.

Rows go from the coarsest to the finest grid. MSE are texts: the paper truncates them, and so they are compared.
"""

from dataclasses import dataclass

CUBE_SIZES = (10, 19, 37, 73, 145, 289, 577)

# Table 2.
CUBE_MSE = {
    "fsm": ("2.5692e-03", "9.7901e-04", "3.7697e-04", "1.4352e-04", "5.3092e-05", "1.8949e-05", "6.5244e-06"),
    "vdt": ("1.4791e-34", "1.8869e-34", "1.0579e-34", "5.0275e-35", "2.5195e-35", "1.3057e-35", "6.5770e-36"),
    "fmm": ("2.5692e-03", "9.7902e-04", "3.7697e-04", "1.4352e-04", "5.3092e-05", "1.8949e-05", "6.5244e-06"),
    "dp": ("4.2278e-33", "5.0110e-33", "1.1519e-32", "8.4144e-33", "9.4543e-33", "3.4273e-32", "1.4046e-31"),
}


@dataclass(frozen=True)
class Row:
    """One line of a table of times: seconds."""

    initial: float
    fsm: float
    vdt: float
    fmm: float
    dp: float
    fixed: int | None = None


# Table 3.
CUBE_SECONDS = (
    Row(0, 0.001, 0.002, 0.001, 0.001),
    Row(0, 0.002, 0.017, 0.002, 0.002),
    Row(0.001, 0.008, 0.029, 0.016, 0.015),
    Row(0.014, 0.059, 0.186, 0.18, 0.138),
    Row(0.105, 0.352, 1.416, 1.988, 1.441),
    Row(0.816, 2.881, 11.352, 26.109, 15.425),
    Row(6.375, 24.442, 88.836, 313.009, 159.762),
)

TEDDY_SHAPES = (
    (15, 21, 9),
    (29, 41, 17),
    (57, 81, 32),
    (113, 161, 62),
    (224, 321, 122),
    (447, 640, 242),
    (893, 1279, 482),
)
TEDDY_SPACINGS = (0.1, 0.05, 0.025, 0.0125, 0.00625, 0.003125, 0.0015625)

# Table 4: the teddy's vertices.
TEDDY_CLOUD = (
    Row(0.001, 0.002, 0.002, 0.001, 0.001, 1003),
    Row(0.002, 0.007, 0.024, 0.005, 0.005, 3906),
    Row(0.007, 0.036, 0.083, 0.059, 0.054, 14428),
    Row(0.042, 0.253, 0.562, 0.658, 0.605, 47575),
    Row(0.293, 1.891, 4.135, 9.079, 7.638, 76231),
    Row(2.235, 15.335, 33.126, 121.185, 103.515, 76384),
    Row(19.085, 118.572, 254.895, 1439.6, 1221.13, 76384),
)

# Table 5: its triangles.
TEDDY_MESH = (
    Row(0.039, 0.001, 0.007, 0.001, 0.001, 1283),
    Row(0.048, 0.007, 0.056, 0.005, 0.008, 5147),
    Row(0.067, 0.04, 0.446, 0.057, 0.08, 20526),
    Row(0.139, 0.255, 3.408, 0.659, 0.828, 82756),
    Row(0.504, 1.966, 26.054, 9.475, 11.02, 331874),
    Row(2.877, 16.211, 203.035, 120.117, 131.252, 1332140),
    Row(19.807, 126.331, 1578.07, 1441.91, 1394.25, 5346482),
)

# Table 6: distances from a triangle to a point that were computed.
TRIANGLE_DISTANCES = {
    "vdt": (61043, 629890, 5359252, 43690983, 349466298, 2808035440, 22508797856),
    "dp": (3605, 40776, 364370, 3067140, 25049348, 202613176, 1631172583),
}

SPONGE_SPACINGS = (0.1, 0.05, 0.025, 0.0125, 0.00625)
SPONGE_SHAPES = ((43, 32, 32), (85, 62, 62), (168, 123, 123), (334, 245, 245), (667, 488, 488))

# Table 7: contiguous initialisation; initial condition and original FSM, seconds.
SPONGE_CONTIGUOUS = (12357, 86306, 628799, 4781922, 38269939)
SPONGE_FSM_SECONDS = ((0.003, 0.007), (0.018, 0.049), (0.13, 0.371), (1.003, 2.9), (8.071, 23.829))

# Table 8: Alg. 1; initial condition and original VDT, seconds.
SPONGE_CELLS = (1890, 2716, 2892, 2912, 2912)
SPONGE_VDT_SECONDS = ((0.001, 0.028), (0.014, 0.143), (0.09, 0.922), (0.702, 7.563), (5.62, 59.763))
