// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "FramePace.h"

#include <algorithm>

namespace teravox
{

void FramePace::Spend(double seconds, double budget)
{
  this->Spent += seconds;
  this->Budget = budget;
}

void FramePace::Begin()
{
  if (this->Budget > 0)
  {
    if (!this->MayGuess())
    {
      this->Plain = this->Spent;
      this->Gain = 0;
    }
    else if (this->Gain == 0)
    {
      this->Gain = this->Spent > 0 ? std::max(this->Plain / this->Spent, 1.0) : 1.0;
    }
    if (this->Spent > this->Budget)
    {
      this->Looseness_ = std::min(this->Looseness_ * 4, MostLoose);
    }
    else if (this->Spent < 0.5 * this->Budget)
    {
      const double tighter = std::max(this->Looseness_ / 2, 1.0);
      const bool endsGuesses = this->MayGuess() && tighter < GuessedFrom;
      const bool isFast = this->Spent * this->Gain < 0.5 * this->Budget;
      this->Looseness_ = endsGuesses && !isFast ? this->Looseness_ : tighter;
    }
  }
  this->Spent = 0;
  this->Budget = 0;
}

} // namespace teravox
