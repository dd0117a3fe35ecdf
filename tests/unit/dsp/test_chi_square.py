import numpy as np
import pytest
from scipy.stats import chi2, norm

from strapdown.dsp import chi_square as ours

FREEDOM = np.array([1.0, 3.0, 30.0, 10_083.0])
SHARE = np.array([1e-12, 0.025, 0.5, 0.975])
VALUE = np.array([0.0, 0.3, 40.0, 9_800.0])


@pytest.mark.parametrize(
    ("one", "same", "x"),
    [
        (ours.chi_square_quantile, chi2.ppf, SHARE),
        (ours.chi_square_exceeded, chi2.isf, SHARE),
        (ours.chi_square_below, chi2.cdf, VALUE),
        (ours.chi_square_above, chi2.sf, VALUE),
    ],
)
def test_chi_square_is_that_of_scipy_to_the_last_bit(one, same, x):
    whole = one(x[:, None], FREEDOM)
    np.testing.assert_array_equal(whole, same(x[:, None], FREEDOM))
    assert type(one(float(x[1]), 3)) is float
    assert one(float(x[1]), 3) == whole[1, 1]


def test_the_normal_distribution_is_that_of_scipy_to_the_last_bit():
    np.testing.assert_array_equal(ours.normal_quantile(SHARE), norm.ppf(SHARE))
    np.testing.assert_array_equal(ours.normal_above(VALUE), norm.sf(VALUE))
