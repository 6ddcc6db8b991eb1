// Products of meshes: which are kept, and who makes them.
#include "server/sessions/kept_products.h"

#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include "gtest/gtest.h"
#include "server/jobs/memory_budget.h"
#include "server/store/memory_mesh.h"
#include "tests/server/service_harness.h"

namespace wellspace::server {
namespace {

struct Product {
  MemoryReservation memory;
  uint64_t revision = 0;
  int kind = 0;
};

class KeptProductsTest : public ::testing::Test {
 protected:
  using Made = std::shared_ptr<const Product>;

  // The kept product of this kind, or a new one.
  Made Prepare(uint64_t revision, int kind, bool* is_at_work = nullptr) {
    return products_
        .Prepare([&] { return MeshOf(revision); }, [&](const MeshSnapshot& mesh) { return Make(mesh, kind); },
                 [kind](const Product& product) { return product.kind == kind; }, is_at_work)
        .value();
  }
  static absl::StatusOr<std::shared_ptr<const MeshSnapshot>> MeshOf(uint64_t revision) {
    core::Mesh mesh;
    mesh.dimension = 2;
    return std::make_shared<MemoryMesh>(revision, std::move(mesh));
  }
  absl::StatusOr<Made> Make(const MeshSnapshot& mesh, int kind) {
    ++made_;
    auto product = std::make_shared<Product>();
    product->memory = memory_.Reserve(100, "a product").value();
    product->revision = mesh.revision();
    product->kind = kind;
    return product;
  }
  bool Has(uint64_t revision, int kind) {
    return products_.Find(revision, [kind](const Product& product) { return product.kind == kind; }) != nullptr;
  }

  MemoryBudget memory_{0};
  KeptProducts<Product> products_{2};
  int made_ = 0;
};

TEST_F(KeptProductsTest, TheOldestGoesWhereThereAreAsManyAsMayBe) {
  const Made first = Prepare(1, 1);
  EXPECT_EQ(Prepare(1, 1), first);
  Prepare(1, 2);
  EXPECT_EQ(made_, 2);
  Prepare(1, 3);
  EXPECT_FALSE(Has(1, 1));
  EXPECT_TRUE(Has(1, 2) && Has(1, 3));
  EXPECT_EQ(made_, 3);
  EXPECT_EQ(memory_.reserved(), 300u) << "one is in use";
}

TEST_F(KeptProductsTest, ThoseOfAnotherMeshGoAndOfOneBeforeAreNotKept) {
  Prepare(1, 1);
  Prepare(1, 2);
  Prepare(2, 1);
  EXPECT_FALSE(Has(1, 1) || Has(1, 2));
  EXPECT_TRUE(Has(2, 1));
  EXPECT_EQ(Prepare(1, 2)->revision, 1u) << "for a caller that began before the mesh changed";
  EXPECT_FALSE(Has(1, 2));
  EXPECT_TRUE(Has(2, 1));
  EXPECT_EQ(memory_.reserved(), 100u);
}

// The mesh is replaced while a product of it is made.
TEST_F(KeptProductsTest, OfAMeshThatIsReplacedMeanwhileNoneIsKept) {
  const auto made = products_.Prepare([] { return MeshOf(1); },
                                      [&](const MeshSnapshot& mesh) {
                                        EXPECT_TRUE(products_.Drop().empty());
                                        return Make(mesh, 1);
                                      });
  EXPECT_EQ((*made)->revision, 1u);
  EXPECT_FALSE(Has(1, 1));
  Prepare(2, 1);
  EXPECT_TRUE(Has(2, 1));
}

TEST_F(KeptProductsTest, AreHandedOver) {
  const Made first = Prepare(1, 1);
  KeptProducts<Product> earlier(2);
  EXPECT_TRUE(earlier.Replace(products_.Drop()).empty());
  EXPECT_EQ(earlier.Find(1), first);
  EXPECT_FALSE(Has(1, 1));
  EXPECT_TRUE(products_.WasAskedFor(1));
  Prepare(2, 1);
  EXPECT_TRUE(products_.WasAskedFor(2) && !products_.WasAskedFor(1));
}

TEST_F(KeptProductsTest, WhatIsInUseIsNotSpare) {
  const Made in_use = Prepare(1, 1);
  Prepare(1, 2);
  EXPECT_EQ(products_.SpareBytes(), 100u);
  EXPECT_EQ(products_.GiveUp().size(), 1u);
  EXPECT_TRUE(Has(1, 1));
  EXPECT_EQ(products_.SpareBytes(), 0u);
  EXPECT_EQ(products_.Drop().size(), 1u);
  EXPECT_FALSE(Has(1, 1));
  EXPECT_EQ(memory_.reserved(), 100u);
}

TEST_F(KeptProductsTest, WhoNeedNotWaitIsToldAndHasWhatIsThere) {
  Prepare(1, 1);
  Event is_making;
  Event may_end;
  std::thread maker([&] {
    const auto make = [&](const MeshSnapshot& mesh) {
      is_making.Set();
      EXPECT_TRUE(may_end.Wait());
      return Make(mesh, 2);
    };
    EXPECT_TRUE(
        products_.Prepare([] { return MeshOf(1); }, make, [](const Product& product) { return product.kind == 2; })
            .ok());
  });
  ASSERT_TRUE(is_making.Wait());
  EXPECT_TRUE(products_.IsMaking());
  bool is_at_work = false;
  EXPECT_EQ(Prepare(1, 2, &is_at_work), nullptr);
  EXPECT_TRUE(is_at_work);
  is_at_work = false;
  EXPECT_NE(Prepare(1, 1, &is_at_work), nullptr);
  EXPECT_FALSE(is_at_work);
  may_end.Set();
  maker.join();
  EXPECT_FALSE(products_.IsMaking());
  EXPECT_NE(Prepare(1, 2, &is_at_work), nullptr);
  EXPECT_FALSE(is_at_work);
  EXPECT_EQ(made_, 2);
}

}  // namespace
}  // namespace wellspace::server
