"""Many runs: what a run is made from, the row of figures that it leaves, and the workers that make the rows.

    from mirotwin import campaign

    if __name__ == "__main__":                          # the processes import this script
        plan = campaign.load("noise.toml")              # or campaign.parse(text, "noise.toml")
        campaign.run(plan, "noise.parquet")             # or with any executor of concurrent.futures
        table, about = campaign.read("noise.parquet")   # an Arrow table, a row a run

Names, those of the stub beside this file, are loaded on first use: workers read this file before their engine is
chosen.
"""

from mirotwin import names_of_stub

__getattr__ = names_of_stub(__name__)
