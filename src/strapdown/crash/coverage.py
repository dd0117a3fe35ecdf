"""What share of a normal distribution a bound holds."""

#: 95 % of a normal distribution lie within so many standard deviations.
TWO_SIDED_95 = 1.959963984540054
