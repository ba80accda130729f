//! Direction numbers of Sobol sequences: the first rows of the set `new-joe-kuo-6.21201` of S. Joe and F. Y. Kuo, "Constructing
//! Sobol sequences with better two-dimensional projections", SIAM J. Sci. Comput. 30 (2008), 2635-2654. Their licence:

// Copyright (c) 2008, Frances Y. Kuo and Stephen Joe
// All rights reserved.
//
// Redistribution and use in source and binary forms, with or without modification, are permitted provided that the following
// conditions are met:
//
//     * Redistributions of source code must retain the above copyright notice, this list of conditions and the following
//       disclaimer.
//
//     * Redistributions in binary form must reproduce the above copyright notice, this list of conditions and the following
//       disclaimer in the documentation and/or other materials provided with the distribution.
//
//     * Neither the names of the copyright holders nor the names of the University of New South Wales and the University of
//       Waikato and its contributors may be used to endorse or promote products derived from this software without specific
//       prior written permission.
//
// THIS SOFTWARE IS PROVIDED BY THE COPYRIGHT HOLDERS "AS IS" AND ANY EXPRESS OR IMPLIED WARRANTIES, INCLUDING, BUT NOT LIMITED
// TO, THE IMPLIED WARRANTIES OF MERCHANTABILITY AND FITNESS FOR A PARTICULAR PURPOSE ARE DISCLAIMED. IN NO EVENT SHALL THE
// COPYRIGHT HOLDERS BE LIABLE FOR ANY DIRECT, INDIRECT, INCIDENTAL, SPECIAL, EXEMPLARY, OR CONSEQUENTIAL DAMAGES (INCLUDING, BUT
// NOT LIMITED TO, PROCUREMENT OF SUBSTITUTE GOODS OR SERVICES; LOSS OF USE, DATA, OR PROFITS; OR BUSINESS INTERRUPTION) HOWEVER
// CAUSED AND ON ANY THEORY OF LIABILITY, WHETHER IN CONTRACT, STRICT LIABILITY, OR TORT (INCLUDING NEGLIGENCE OR OTHERWISE)
// ARISING IN ANY WAY OUT OF THE USE OF THIS SOFTWARE, EVEN IF ADVISED OF THE POSSIBILITY OF SUCH DAMAGE.

/// One dimension of a Sobol sequence.
pub(super) struct Row {
    /// Primitive polynomial over GF(2), leading coefficient first: bit s is the coefficient of x^s, bit 0 is 1.
    pub polynomial: u16,
    /// Initial numbers m_1 … m_s; their count is the degree s of the polynomial.
    pub initial: &'static [u16],
}

const fn row(polynomial: u16, initial: &'static [u16]) -> Row {
    Row { polynomial, initial }
}

/// Dimensions 2 to 128; dimension 1 is the van der Corput sequence.
pub(super) const ROWS: [Row; 127] = [
    row(0b11, &[1]),
    row(0b111, &[1, 3]),
    row(0b1011, &[1, 3, 1]),
    row(0b1101, &[1, 1, 1]),
    row(0b10011, &[1, 1, 3, 3]),
    row(0b11001, &[1, 3, 5, 13]),
    row(0b100101, &[1, 1, 5, 5, 17]),
    row(0b101001, &[1, 1, 5, 5, 5]),
    row(0b101111, &[1, 1, 7, 11, 19]),
    row(0b110111, &[1, 1, 5, 1, 1]),
    row(0b111011, &[1, 1, 1, 3, 11]),
    row(0b111101, &[1, 3, 5, 5, 31]),
    row(0b1000011, &[1, 3, 3, 9, 7, 49]),
    row(0b1011011, &[1, 1, 1, 15, 21, 21]),
    row(0b1100001, &[1, 3, 1, 13, 27, 49]),
    row(0b1100111, &[1, 1, 1, 15, 7, 5]),
    row(0b1101101, &[1, 3, 1, 15, 13, 25]),
    row(0b1110011, &[1, 1, 5, 5, 19, 61]),
    row(0b10000011, &[1, 3, 7, 11, 23, 15, 103]),
    row(0b10001001, &[1, 3, 7, 13, 13, 15, 69]),
    row(0b10001111, &[1, 1, 3, 13, 7, 35, 63]),
    row(0b10010001, &[1, 3, 5, 9, 1, 25, 53]),
    row(0b10011101, &[1, 3, 1, 13, 9, 35, 107]),
    row(0b10100111, &[1, 3, 1, 5, 27, 61, 31]),
    row(0b10101011, &[1, 1, 5, 11, 19, 41, 61]),
    row(0b10111001, &[1, 3, 5, 3, 3, 13, 69]),
    row(0b10111111, &[1, 1, 7, 13, 1, 19, 1]),
    row(0b11000001, &[1, 3, 7, 5, 13, 19, 59]),
    row(0b11001011, &[1, 1, 3, 9, 25, 29, 41]),
    row(0b11010011, &[1, 3, 5, 13, 23, 1, 55]),
    row(0b11010101, &[1, 3, 7, 3, 13, 59, 17]),
    row(0b11100101, &[1, 3, 1, 3, 5, 53, 69]),
    row(0b11101111, &[1, 1, 5, 5, 23, 33, 13]),
    row(0b11110001, &[1, 1, 7, 7, 1, 61, 123]),
    row(0b11110111, &[1, 1, 7, 9, 13, 61, 49]),
    row(0b11111101, &[1, 3, 3, 5, 3, 55, 33]),
    row(0b100011101, &[1, 3, 1, 15, 31, 13, 49, 245]),
    row(0b100101011, &[1, 3, 5, 15, 31, 59, 63, 97]),
    row(0b100101101, &[1, 3, 1, 11, 11, 11, 77, 249]),
    row(0b101001101, &[1, 3, 1, 11, 27, 43, 71, 9]),
    row(0b101011111, &[1, 1, 7, 15, 21, 11, 81, 45]),
    row(0b101100011, &[1, 3, 7, 3, 25, 31, 65, 79]),
    row(0b101100101, &[1, 3, 1, 1, 19, 11, 3, 205]),
    row(0b101101001, &[1, 1, 5, 9, 19, 21, 29, 157]),
    row(0b101110001, &[1, 3, 7, 11, 1, 33, 89, 185]),
    row(0b110000111, &[1, 3, 3, 3, 15, 9, 79, 71]),
    row(0b110001101, &[1, 3, 7, 11, 15, 39, 119, 27]),
    row(0b110101001, &[1, 1, 3, 1, 11, 31, 97, 225]),
    row(0b111000011, &[1, 1, 1, 3, 23, 43, 57, 177]),
    row(0b111001111, &[1, 3, 7, 7, 17, 17, 37, 71]),
    row(0b111100111, &[1, 3, 1, 5, 27, 63, 123, 213]),
    row(0b111110101, &[1, 1, 3, 5, 11, 43, 53, 133]),
    row(0b1000010001, &[1, 3, 5, 5, 29, 17, 47, 173, 479]),
    row(0b1000011011, &[1, 3, 3, 11, 3, 1, 109, 9, 69]),
    row(0b1000100001, &[1, 1, 1, 5, 17, 39, 23, 5, 343]),
    row(0b1000101101, &[1, 3, 1, 5, 25, 15, 31, 103, 499]),
    row(0b1000110011, &[1, 1, 1, 11, 11, 17, 63, 105, 183]),
    row(0b1001011001, &[1, 1, 5, 11, 9, 29, 97, 231, 363]),
    row(0b1001011111, &[1, 1, 5, 15, 19, 45, 41, 7, 383]),
    row(0b1001101001, &[1, 3, 7, 7, 31, 19, 83, 137, 221]),
    row(0b1001101111, &[1, 1, 1, 3, 23, 15, 111, 223, 83]),
    row(0b1001110111, &[1, 1, 5, 13, 31, 15, 55, 25, 161]),
    row(0b1001111101, &[1, 1, 3, 13, 25, 47, 39, 87, 257]),
    row(0b1010000111, &[1, 1, 1, 11, 21, 53, 125, 249, 293]),
    row(0b1010010101, &[1, 1, 7, 11, 11, 7, 57, 79, 323]),
    row(0b1010100011, &[1, 1, 5, 5, 17, 13, 81, 3, 131]),
    row(0b1010100101, &[1, 1, 7, 13, 23, 7, 65, 251, 475]),
    row(0b1010101111, &[1, 3, 5, 1, 9, 43, 3, 149, 11]),
    row(0b1010110111, &[1, 1, 3, 13, 31, 13, 13, 255, 487]),
    row(0b1010111101, &[1, 3, 3, 1, 5, 63, 89, 91, 127]),
    row(0b1011001111, &[1, 1, 3, 3, 1, 19, 123, 127, 237]),
    row(0b1011010001, &[1, 1, 5, 7, 23, 31, 37, 243, 289]),
    row(0b1011011011, &[1, 1, 5, 11, 17, 53, 117, 183, 491]),
    row(0b1011110101, &[1, 1, 1, 5, 1, 13, 13, 209, 345]),
    row(0b1011111001, &[1, 1, 3, 15, 1, 57, 115, 7, 33]),
    row(0b1100010011, &[1, 3, 1, 11, 7, 43, 81, 207, 175]),
    row(0b1100010101, &[1, 3, 1, 1, 15, 27, 63, 255, 49]),
    row(0b1100011111, &[1, 3, 5, 3, 27, 61, 105, 171, 305]),
    row(0b1100100011, &[1, 1, 5, 3, 1, 3, 57, 249, 149]),
    row(0b1100110001, &[1, 1, 3, 5, 5, 57, 15, 13, 159]),
    row(0b1100111011, &[1, 1, 1, 11, 7, 11, 105, 141, 225]),
    row(0b1101001111, &[1, 3, 3, 5, 27, 59, 121, 101, 271]),
    row(0b1101011011, &[1, 3, 5, 9, 11, 49, 51, 59, 115]),
    row(0b1101100001, &[1, 1, 7, 1, 23, 45, 125, 71, 419]),
    row(0b1101101011, &[1, 1, 3, 5, 23, 5, 105, 109, 75]),
    row(0b1101101101, &[1, 1, 7, 15, 7, 11, 67, 121, 453]),
    row(0b1101110011, &[1, 3, 7, 3, 9, 13, 31, 27, 449]),
    row(0b1101111111, &[1, 3, 1, 15, 19, 39, 39, 89, 15]),
    row(0b1110000101, &[1, 1, 1, 1, 1, 33, 73, 145, 379]),
    row(0b1110001111, &[1, 3, 1, 15, 15, 43, 29, 13, 483]),
    row(0b1110110101, &[1, 1, 7, 3, 19, 27, 85, 131, 431]),
    row(0b1110111001, &[1, 3, 3, 3, 5, 35, 23, 195, 349]),
    row(0b1111000111, &[1, 3, 3, 7, 9, 27, 39, 59, 297]),
    row(0b1111001011, &[1, 1, 3, 9, 11, 17, 13, 241, 157]),
    row(0b1111001101, &[1, 3, 7, 15, 25, 57, 33, 189, 213]),
    row(0b1111010101, &[1, 1, 7, 1, 9, 55, 73, 83, 217]),
    row(0b1111011001, &[1, 3, 3, 13, 19, 27, 23, 113, 249]),
    row(0b1111100011, &[1, 3, 5, 3, 23, 43, 3, 253, 479]),
    row(0b1111101001, &[1, 1, 5, 5, 11, 5, 45, 117, 217]),
    row(0b1111111011, &[1, 3, 3, 7, 29, 37, 33, 123, 147]),
    row(0b10000001001, &[1, 3, 1, 15, 5, 5, 37, 227, 223, 459]),
    row(0b10000011011, &[1, 1, 7, 5, 5, 39, 63, 255, 135, 487]),
    row(0b10000100111, &[1, 3, 1, 7, 9, 7, 87, 249, 217, 599]),
    row(0b10000101101, &[1, 1, 3, 13, 9, 47, 7, 225, 363, 247]),
    row(0b10001100101, &[1, 3, 7, 13, 19, 13, 9, 67, 9, 737]),
    row(0b10001101111, &[1, 3, 5, 5, 19, 59, 7, 41, 319, 677]),
    row(0b10010000001, &[1, 1, 5, 3, 31, 63, 15, 43, 207, 789]),
    row(0b10010001011, &[1, 1, 7, 9, 13, 39, 3, 47, 497, 169]),
    row(0b10011000101, &[1, 3, 1, 7, 21, 17, 97, 19, 415, 905]),
    row(0b10011010111, &[1, 3, 7, 1, 3, 31, 71, 111, 165, 127]),
    row(0b10011100111, &[1, 1, 5, 11, 1, 61, 83, 119, 203, 847]),
    row(0b10011110011, &[1, 3, 3, 13, 9, 61, 19, 97, 47, 35]),
    row(0b10011111111, &[1, 1, 7, 7, 15, 29, 63, 95, 417, 469]),
    row(0b10100001101, &[1, 3, 1, 9, 25, 9, 71, 57, 213, 385]),
    row(0b10100011001, &[1, 3, 5, 13, 31, 47, 101, 57, 39, 341]),
    row(0b10100100011, &[1, 1, 3, 3, 31, 57, 125, 173, 365, 551]),
    row(0b10100110001, &[1, 3, 7, 1, 13, 57, 67, 157, 451, 707]),
    row(0b10100111101, &[1, 1, 1, 7, 21, 13, 105, 89, 429, 965]),
    row(0b10101000011, &[1, 1, 5, 9, 17, 51, 45, 119, 157, 141]),
    row(0b10101010111, &[1, 3, 7, 7, 13, 45, 91, 9, 129, 741]),
    row(0b10101101011, &[1, 3, 7, 1, 23, 57, 67, 141, 151, 571]),
    row(0b10110000101, &[1, 1, 3, 11, 17, 47, 93, 107, 375, 157]),
    row(0b10110001111, &[1, 3, 3, 5, 11, 21, 43, 51, 169, 915]),
    row(0b10110010111, &[1, 1, 5, 3, 15, 55, 101, 67, 455, 625]),
    row(0b10110100001, &[1, 3, 5, 9, 1, 23, 29, 47, 345, 595]),
    row(0b10111000111, &[1, 3, 7, 7, 5, 49, 29, 155, 323, 589]),
    row(0b10111100101, &[1, 3, 3, 7, 5, 41, 127, 61, 261, 717]),
];
