// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "MessageRecorder.h"
#include "VTKTestSupport.h"
#include "vtkBrickSource.h"
#include "vtkProceduralVolumeSource.h"

#include <gtest/gtest.h>
#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkInformationObjectBaseKey.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkWeakPointer.h>

namespace
{

using teravox::test::IndexBrickSource;

TEST(VTKBrickSource, IsFoundOnTheArrayItWasAttachedTo)
{
  vtkNew<vtkFloatArray> array;
  EXPECT_EQ(vtkBrickSource::Get(array), nullptr);
  EXPECT_EQ(vtkBrickSource::Get(nullptr), nullptr);
  vtkNew<vtkBrickSource> holder;
  holder->Attach(array);
  EXPECT_EQ(vtkBrickSource::Get(array), holder.Get());
}

TEST(VTKBrickSource, IsNotFoundOnACopyThatCopiedTheInformation)
{
  vtkNew<vtkFloatArray> array;
  array->SetNumberOfTuples(3);
  vtkNew<vtkBrickSource> holder;
  holder->Attach(array);
  vtkNew<vtkFloatArray> deep;
  deep->DeepCopy(array);
  vtkNew<vtkFloatArray> shallow;
  shallow->ShallowCopy(array);
  vtkNew<vtkFloatArray> byKey;
  byKey->GetInformation()->Set(vtkBrickSource::BRICK_SOURCE(), holder);
  EXPECT_EQ(vtkBrickSource::Get(deep), nullptr);
  EXPECT_EQ(vtkBrickSource::Get(shallow), nullptr);
  EXPECT_EQ(vtkBrickSource::Get(byKey), nullptr);
}

TEST(VTKBrickSource, BelongsToOneArray)
{
  vtkNew<vtkFloatArray> first;
  vtkNew<vtkFloatArray> second;
  vtkNew<vtkBrickSource> holder;
  holder->Attach(first);
  holder->Attach(second);
  EXPECT_EQ(vtkBrickSource::Get(first), nullptr);
  EXPECT_EQ(vtkBrickSource::Get(second), holder.Get());
}

TEST(VTKBrickSource, DoesNotKeepTheArrayAliveButTheArrayKeepsIt)
{
  vtkWeakPointer<vtkBrickSource> holder;
  vtkWeakPointer<vtkFloatArray> weakArray;
  {
    vtkNew<vtkFloatArray> array;
    weakArray = array.Get();
    {
      vtkNew<vtkBrickSource> made;
      holder = made.Get();
      made->Attach(array);
    }
    EXPECT_NE(holder.GetPointer(), nullptr);
  }
  EXPECT_EQ(weakArray.GetPointer(), nullptr);
  EXPECT_EQ(holder.GetPointer(), nullptr);
}

TEST(VTKBrickSource, KnowsWhetherAnImageWasMoved)
{
  vtkNew<vtkProceduralVolumeSource> volume;
  volume->SetDimensions(100, 80, 60);
  volume->SetOrigin(3, -2, 0.5);
  volume->SetSpacing(0.1, 0.3, 7);
  for (const int level : { 0, 1 })
  {
    volume->SetLevel(level);
    int part[6] = { 8, 20, 3, 30, 5, 9 };
    volume->UpdateExtent(part);
    vtkNew<vtkImageData> image;
    image->ShallowCopy(volume->GetOutput());
    vtkBrickSource* holder = vtkBrickSource::Get(image->GetPointData()->GetScalars());
    ASSERT_NE(holder, nullptr);
    EXPECT_TRUE(holder->IsInPlace(image));
    EXPECT_FALSE(holder->IsInPlace(nullptr));
    image->SetExtent(7, 19, 3, 30, 5, 9);
    EXPECT_FALSE(holder->IsInPlace(image));
    image->SetExtent(part);
    image->SetOrigin(3, -2, 0.6);
    EXPECT_FALSE(holder->IsInPlace(image));
    image->SetOrigin(volume->GetOutput()->GetOrigin());
    EXPECT_TRUE(holder->IsInPlace(image));
    image->SetSpacing(0.1, 0.3, 8);
    EXPECT_FALSE(holder->IsInPlace(image));
    image->SetSpacing(volume->GetOutput()->GetSpacing());
    image->SetDirectionMatrix(-1, 0, 0, 0, 1, 0, 0, 0, 1);
    EXPECT_FALSE(holder->IsInPlace(image));
  }
  vtkNew<vtkBrickSource> empty;
  EXPECT_FALSE(empty->IsInPlace(volume->GetOutput()));
}

TEST(VTKBrickSource, TellsOfMemoryThatCannotBeHad)
{
  vtkNew<vtkProceduralVolumeSource> volume;
  volume->SetDimensions(1 << 30, 1 << 30, 1 << 30); // 2^90 voxels at level 0, 2^60 at level 10
  for (const int level : { 0, 10 })
  {
    volume->SetLevel(level);
    vtkNew<teravox::test::MessageRecorder> errors;
    volume->RemoveAllObservers();
    volume->AddObserver(vtkCommand::ErrorEvent, errors);
    volume->Update();
    ASSERT_EQ(errors->Messages.size(), 1u);
    EXPECT_NE(errors->Messages[0].find("can't be had"), std::string::npos) << errors->Messages[0];
  }
}

TEST(VTKBrickSource, TellsWhatTheSourceSays)
{
  vtkNew<vtkBrickSource> holder;
  EXPECT_EQ(holder->GetNumberOfLevels(), 0);
  EXPECT_EQ(holder->GetScalarType(), VTK_VOID);
  const auto source = IndexBrickSource::Make({ 100, 50, 25 }, 16, 2);
  source->Info_.Range = { -3.0, 7.0 };
  const vtkMTimeType before = holder->GetMTime();
  holder->SetBrickSource(source);
  EXPECT_GT(holder->GetMTime(), before);
  EXPECT_EQ(holder->GetNumberOfLevels(), source->Info().Layout.NumberOfLevels());
  EXPECT_EQ(holder->GetScalarType(), VTK_DOUBLE);
  EXPECT_EQ(holder->GetNumberOfComponents(), 2);
  long long size[3];
  holder->GetLevelDimensions(1, size);
  EXPECT_EQ(size[0], 50);
  EXPECT_EQ(size[1], 25);
  EXPECT_EQ(size[2], 13);
  holder->GetLevelDimensions(99, size);
  EXPECT_EQ(size[0], 0);
  double range[2];
  holder->GetScalarRange(range);
  EXPECT_EQ(range[0], -3.0);
  EXPECT_EQ(range[1], 7.0);
}

} // namespace
