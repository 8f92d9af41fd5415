"""Campaigns of many runs: the plan, the row of figures of each run, and the workers that compute the rows.

    from mirotwin import campaign

    if __name__ == "__main__":                          # the processes import this script
        plan = campaign.load("noise.toml")              # or campaign.parse(text, "noise.toml")
        campaign.run(plan, "noise.parquet")             # or with any executor of concurrent.futures
        table, about = campaign.read("noise.parquet")   # an Arrow table, a row a run

The names of the stub beside this file are loaded on first use: workers import this file before their engine is chosen.
"""

from mirotwin import names_of_stub

__getattr__ = names_of_stub(__name__)
