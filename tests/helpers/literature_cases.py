"""Published cases that more than one method is held against; the sources stand in the tests of `tests/literature`."""

HAN_RATIOS = {
    "rayleigh": (1896, [5.459, 13.046, 21.664]),
    "timoshenko": (1696, [3.991, 8.412, 12.037, 14.829, 17.224]),
}


LABUSCHAGNE = {
    ("timoshenko", 0.1): [0.0316, 1.14, 7.86, 25.9, 59.9, 113, 188, 284],
    ("euler_bernoulli", 0.1): [0.0321, 1.26, 9.90, 38.0, 104, 232, 452, 801],
    ("timoshenko", 0.2): [0.121, 3.51, 19.9, 54.8, 111, 187, 278, 330, 394, 440, 542, 596, 732, 782],
    ("euler_bernoulli", 0.2): [0.129, 5.05, 39.6, 152, 415, 927, 1810, 3210],
}
