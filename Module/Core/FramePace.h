// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace teravox
{

/// How exact frames are that must be fast. The tolerance is multiplied while they take too long,
/// and divided again when there is time. Where that isn't enough, pixels between rays may be
/// guessed; then it stays so until a frame without guesses would be fast enough, as far as is
/// known: else every other frame would be a slow one. Thread: none.
class FramePace
{
public:
  static constexpr double MostLoose = 4096;
  /// From this factor on pixels may be guessed.
  static constexpr double GuessedFrom = 64;

  /// Factor of the tolerance of the present frame, 1 to MostLoose.
  double Looseness() const { return this->Looseness_; }
  bool MayGuess() const { return this->Looseness_ >= GuessedFrom; }
  /// What the present frame, or a part of it, has taken and may take, in seconds; > 0.
  void Spend(double seconds, double budget);
  /// The next frame begins. One without a budget changes nothing.
  void Begin();
  /// The present frame is as exact as it is asked for.
  void Tighten() { this->Looseness_ = 1; }

private:
  double Looseness_ = 1;
  double Spent = 0;
  double Budget = 0; ///< 0: none
  double Plain = 0;  ///< seconds of the last frame without guesses, 0: none
  double Gain = 0;   ///< how many times as long as the first one with guesses that took, 0: unknown
};

} // namespace teravox
