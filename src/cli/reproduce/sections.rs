//! The figures of the page, section by section: their headings and captions.

/// A figure: its number in the paper ("" beyond it), name of its picture, heading, caption.
pub(super) type Entry = (&'static str, &'static str, &'static str, &'static str);

/// Sections of the page with their figures.
pub(super) const SECTIONS: [(&str, &str, &[Entry]); 5] = [
    (
        "clearance",
        "Response to clearance",
        &[
            (
                "5",
                "figure-05",
                "Figure 5: displacement",
                "Position x and angle β of the platform at friction 0.2. Above, the whole period: the curves of the three clearances lie on each other. Below, their distance from the motion with ideal joints while the balls bounce.",
            ),
            (
                "6",
                "figure-06",
                "Figure 6: velocity",
                "Every impact is a step in velocity. After the last one the curves follow the drive.",
            ),
            (
                "7",
                "figure-07",
                "Figure 7: acceleration",
                "Accelerations peak inside impacts, which are much shorter than a millisecond: samples 1 ms apart see a peak only by chance.",
            ),
            (
                "8",
                "figure-08",
                "Figure 8: contact forces at 0.3 mm",
                "Each spike is one impact of a ball on its socket.",
            ),
            (
                "9",
                "figure-09",
                "Figure 9: contact forces at 0.5 mm",
                "A wider gap gives the ball a longer fall and a harder landing.",
            ),
            (
                "10",
                "figure-10",
                "Figure 10: contact forces at 0.7 mm",
                "The hardest and the longest bouncing of the three.",
            ),
        ],
    ),
    (
        "friction",
        "Response to friction",
        &[
            (
                "11",
                "figure-11",
                "Figure 11: displacement",
                "As Figure 5, at 0.3 mm and three friction coefficients.",
            ),
            (
                "12",
                "figure-12",
                "Figure 12: velocity",
                "Until the first landing nothing touches, so that the fall and its largest velocity in x are the same whatever the friction.",
            ),
            (
                "13",
                "figure-13",
                "Figure 13: acceleration",
                "The paper's numbers for x fall as friction grows, while its text says that they rise.",
            ),
            (
                "14",
                "figure-14",
                "Figure 14: contact forces at friction 0.15",
                "0.3 mm of clearance, as in the two figures that follow.",
            ),
            (
                "15",
                "figure-15",
                "Figure 15: contact forces at friction 0.20",
                "The same run as Figure 8. The paper prints other peaks for it here than there.",
            ),
            (
                "16",
                "figure-16",
                "Figure 16: contact forces at friction 0.25",
                "The largest friction of the three.",
            ),
        ],
    ),
    (
        "verification",
        "Verification",
        &[
            (
                "17",
                "figure-17",
                "Figure 17: two formulations and the ideal motion",
                "The paper compares its own program with a commercial one; here two formulations that share no equations of motion stand for them: a spanning forest with independent coordinates, and all bodies with multipliers and Baumgarte stabilisation, the paper's own. Clearance 0.3 mm, friction 0.2. Where only one of the two shows, it covers the other.",
            ),
            (
                "",
                "figure-17-drift",
                "Drift of the Baumgarte form",
                "Left, how far the formulations are apart at equal times. Right, the largest violation of a constraint of the lagrange form so far: stabilisation bounds it and does not remove it.",
            ),
        ],
    ),
    (
        "chaos",
        "Phase portraits, sections and bifurcations",
        &[
            (
                "18",
                "figure-18",
                "Figure 18: phase portraits by clearance",
                "Above, one period of settled motion; below, the first period with its impacts.",
            ),
            (
                "19",
                "figure-19",
                "Figure 19: Poincaré sections by clearance",
                "One point a drive period, at the phase of the start, transient discarded. Sections that coincide in the picture are drawn once.",
            ),
            (
                "20",
                "figure-20",
                "Figure 20: bifurcation over clearance",
                "Above, all kept sections at each clearance, from a cold start at every value and following the motion upward and downward (every 25th value starts cold there, too, and so does the first). Below, how much the sections of one point spread, and how far the followed branches are from the cold start: hysteresis would stand above the resolution.",
            ),
            (
                "21",
                "figure-21",
                "Figure 21: phase portraits by friction",
                "As Figure 18, at 0.3 mm.",
            ),
            (
                "22",
                "figure-22",
                "Figure 22: Poincaré sections by friction",
                "As Figure 19, at 0.3 mm.",
            ),
            (
                "23",
                "figure-23",
                "Figure 23: bifurcation over friction",
                "As Figure 20, at 0.3 mm.",
            ),
        ],
    ),
    (
        "beyond",
        "Beyond the paper",
        &[
            (
                "",
                "exponent-clearance",
                "Largest Lyapunov exponent over clearance",
                "From two nearby runs. Below 0, neighbouring motions meet; above it they part exponentially, which is what chaos means. Exponents below −10 1/s, of the smallest clearances, are left out here and stand in the data. Right, how the estimate settles as the run gets longer, for clearances spread over the range.",
            ),
            (
                "",
                "exponent-friction",
                "Largest Lyapunov exponent over friction",
                "The same at 0.3 mm.",
            ),
            (
                "",
                "map",
                "Clearance and friction together",
                "Every cell is one run from a cold start: its regime, the largest contact force (in the first impacts), the probe's error in settled motion, and how long a small disturbance is remembered (the inverse of the exponent; grey where it grows). Where that takes longer than the run, the regime is not settled.",
            ),
            (
                "",
                "probe",
                "What clearance does to the instrument",
                "Distance of the probe tip from where an ideal machine would have it, which is what a coordinate measuring machine would report wrongly. Left, in settled motion; right, with the first period's impacts.",
            ),
        ],
    ),
];
