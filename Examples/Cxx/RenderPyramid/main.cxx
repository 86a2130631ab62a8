// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Shows an HDF5 pyramid in a window: RenderPyramid FILE.h5
#include <vtkHDF5PyramidReader.h>
#include <vtkInteractorStyleTrackballCamera.h>
#include <vtkNew.h>
#include <vtkOutOfCoreTransferFunction.h>
#include <vtkOutOfCoreVolumeMapper.h>
#include <vtkRenderWindow.h>
#include <vtkRenderWindowInteractor.h>
#include <vtkRenderer.h>
#include <vtkVolume.h>

int main(int argc, char** argv)
{
  vtkNew<vtkHDF5PyramidReader> reader;
  reader->SetFileName(argc > 1 ? argv[1] : "brain.h5");
  vtkNew<vtkOutOfCoreVolumeMapper> mapper;
  mapper->SetInputConnection(reader->GetOutputPort());
  mapper->SetGPUMemoryBudget(512 << 20);
  vtkNew<vtkVolume> volume;
  volume->SetMapper(mapper);
  vtkOutOfCoreTransferFunction::MakeAutomatic(reader->GetBrickSource(), volume->GetProperty());
  vtkNew<vtkRenderer> renderer;
  renderer->AddVolume(volume);
  vtkNew<vtkRenderWindow> window;
  window->SetSize(800, 600);
  window->AddRenderer(renderer);
  vtkNew<vtkRenderWindowInteractor> interactor;
  interactor->SetRenderWindow(window);
  vtkNew<vtkInteractorStyleTrackballCamera> style;
  interactor->SetInteractorStyle(style);
  window->Render();
  interactor->Start();
  return 0;
}
