// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ErrorCapture.h"

#include "ErrorText.h"

#include <cstdio>
#include <fmt/format.h>
#include <mutex>
#include <vtkLogger.h>
#include <vtkObjectFactory.h>
#include <vtkOutputWindow.h>
#include <vtkSmartPointer.h>

namespace
{

class CapturingWindow : public vtkOutputWindow
{
public:
  static CapturingWindow* New();
  vtkTypeMacro(CapturingWindow, vtkOutputWindow);

  void DisplayErrorText(const char* text) override
  {
    const std::string sentence = teravox::ErrorText(text);
    // The executive only says that an algorithm has failed; the algorithm has said or will say why.
    const bool useful = sentence.find("returned failure for request") == std::string::npos;
    const std::lock_guard<std::mutex> lock(this->Mutex);
    if (this->First.empty() && useful)
    {
      this->First = sentence;
    }
  }
  void DisplayWarningText(const char* text) override
  {
    fmt::print(stderr, "teravox: {}\n", teravox::ErrorText(text));
  }
  void DisplayGenericWarningText(const char* text) override { this->DisplayWarningText(text); }
  void DisplayText(const char* text) override { fmt::print(stderr, "{}", text ? text : ""); }

  std::string FirstError() const
  {
    const std::lock_guard<std::mutex> lock(this->Mutex);
    return this->First;
  }
  void Clear()
  {
    const std::lock_guard<std::mutex> lock(this->Mutex);
    this->First.clear();
  }

private:
  mutable std::mutex Mutex;
  std::string First;
};

vtkStandardNewMacro(CapturingWindow);

} // namespace

namespace teravox::program
{

class ErrorCapture::Window
{
public:
  vtkSmartPointer<CapturingWindow> Own = vtkSmartPointer<CapturingWindow>::New();
  vtkSmartPointer<vtkOutputWindow> Before = vtkOutputWindow::GetInstance();
};

ErrorCapture::ErrorCapture()
  : Self(std::make_unique<Window>())
{
  vtkOutputWindow::SetInstance(this->Self->Own);
  vtkLogger::SetStderrVerbosity(vtkLogger::VERBOSITY_OFF);
}

ErrorCapture::~ErrorCapture()
{
  vtkOutputWindow::SetInstance(this->Self->Before);
  vtkLogger::SetStderrVerbosity(vtkLogger::VERBOSITY_INFO);
}

bool ErrorCapture::HasError() const
{
  return !this->Self->Own->FirstError().empty();
}

std::string ErrorCapture::First() const
{
  return this->Self->Own->FirstError();
}

void ErrorCapture::Clear()
{
  this->Self->Own->Clear();
}

} // namespace teravox::program
