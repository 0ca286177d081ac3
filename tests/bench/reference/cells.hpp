// Neighbours of large flocks: every cell lists the boids of its 3 x 3 block, ascending.
#pragma once

#include <cstring>
#include <vector>

#include "flock.hpp"

class Cells {
public:
    Cells(const Trial& trial, const Flock& flock, double range)
        : column_(trial.n), row_(trial.n) {
        const double cell = range * (1 + 1e-6);
        const double across = trial.world.width / cell,
                     along = trial.world.height / cell;
        const double most = 4.0 * double(trial.n) + 16;
        const double shrink =
            std::min(1.0, std::sqrt(most / std::max(across * along, 1.0)));
        columns_ = std::max<i64>(3, i64(across * shrink));
        rows_ = std::max<i64>(3, i64(along * shrink));
        per_width_ = double(columns_) / trial.world.width;
        per_height_ = double(rows_) / trial.world.height;
        capacity_ = std::max<i64>(64, 72 * trial.n / (columns_ * rows_)) / 8 * 8;
        lists_.resize(columns_ * rows_ * capacity_);
        lengths_.resize(columns_ * rows_);
        for (i64 i = 0; i < trial.n; ++i) {
            column_[i] = index(flock.x[i], per_width_, columns_);
            row_[i] = index(flock.y[i], per_height_, rows_);
            enter(i);
        }
    }

    i64 cell(i64 i) const { return row_[i] * columns_ + column_[i]; }
    const u32* list(i64 cell) const { return lists_.data() + cell * capacity_; }
    i64 length(i64 cell) const { return lengths_[cell]; }

    void move(i64 i, double x, double y) {
        const double across = x * per_width_, along = y * per_height_;
        if (across >= column_[i] && across < column_[i] + 1 && along >= row_[i] &&
            along < row_[i] + 1)
            return;
        const int column = index(x, per_width_, columns_);
        const int row = index(y, per_height_, rows_);
        if (column == column_[i] && row == row_[i]) return;
        leave(i);
        column_[i] = column;
        row_[i] = row;
        enter(i);
    }

private:
    static int index(double position, double per_length, i64 cells) {
        const i64 k = i64(std::floor(position * per_length));
        return int((k % cells + cells) % cells);
    }

    template <class Change>
    void each_of_block(i64 i, Change change) {
        for (i64 r = -1; r <= 1; ++r)
            for (i64 c = -1; c <= 1; ++c)
                change((row_[i] + r + rows_) % rows_ * columns_ +
                       (column_[i] + c + columns_) % columns_);
    }

    void enter(i64 i) {
        each_of_block(i, [&](i64 cell) {
            if (i64(lengths_[cell]) == capacity_) double_capacity();
            u32* list = lists_.data() + cell * capacity_;
            u32 place = lengths_[cell]++;
            for (; place > 0 && list[place - 1] > u32(i); --place)
                list[place] = list[place - 1];
            list[place] = u32(i);
        });
    }

    void leave(i64 i) {
        each_of_block(i, [&](i64 cell) {
            u32* list = lists_.data() + cell * capacity_;
            u32* end = list + lengths_[cell]--;
            u32* place = std::find(list, end, u32(i));
            std::memmove(place, place + 1, (end - place - 1) * sizeof(u32));
        });
    }

    void double_capacity() {
        std::vector<u32> wider(2 * lists_.size());
        for (i64 cell = 0; cell < i64(lengths_.size()); ++cell)
            std::copy_n(list(cell), lengths_[cell],
                        wider.data() + 2 * cell * capacity_);
        lists_.swap(wider);
        capacity_ *= 2;
    }

    i64 columns_, rows_, capacity_;
    double per_width_, per_height_;
    std::vector<u32> lists_, lengths_;
    std::vector<int> column_, row_;
};
